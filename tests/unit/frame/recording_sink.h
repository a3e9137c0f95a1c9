// A sink that writes down what it is told and checks the order of it.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "latency.h"
#include "renderer/base/clock.h"
#include "renderer/frame/frame_sink.h"

namespace helio {

class RecordingSink final : public FrameSink {
 public:
  struct TileRecord {
    FrameTag tag;
    std::uint32_t pass = 0;
    bool final = false;
    std::uint32_t samples_per_pixel = 0;
    PixelRect window;
    double at_s = 0;
    bool preview = false;
  };

  void frame_begun(const FrameBegin& begin) override {
    const std::lock_guard lock(mutex_);
    EXPECT_FALSE(open_) << "a frame began inside another";
    EXPECT_GE(begin.tag.revision, newest_.revision);
    EXPECT_GT(begin.tag.frame, newest_.frame);
    open_ = true;
    newest_ = begin.tag;
    begins.push_back(begin);
    begin_times.push_back(now_s());
    begin_cpu.push_back(process_cpu_s());
    changed_.notify_all();
  }

  void tile_ready(FrameTile tile) override {
    if (on_tile) on_tile(tile);
    const std::lock_guard lock(mutex_);
    EXPECT_TRUE(open_) << "a tile outside a frame";
    EXPECT_EQ(tile.tag.frame, newest_.frame);
    EXPECT_EQ(tile.tag.revision, newest_.revision);
    const std::size_t area = std::size_t(tile.pixels.window.area());
    EXPECT_EQ(tile.pixels.radiance[0].size(), tile.preview ? 0 : area);
    EXPECT_EQ(tile.pixels.display[0].size(), tile.preview || with_display ? area : 0);
    EXPECT_EQ(tile.preview, begins.back().preview);
    tiles.push_back(
        {tile.tag, tile.pass, tile.final, tile.samples_per_pixel, tile.pixels.window, now_s(), tile.preview});
    if (keep_pixels) pixels.push_back(std::move(tile.pixels));
    changed_.notify_all();
  }

  void frame_ended(const FrameEnd& end) override {
    const std::lock_guard lock(mutex_);
    EXPECT_TRUE(open_) << "an end without a beginning";
    EXPECT_EQ(end.tag.frame, newest_.frame);
    open_ = false;
    ends.push_back(end);
    end_cpu.push_back(process_cpu_s());
    changed_.notify_all();
  }

  std::size_t backlog() const override { return backlog_tiles.load(); }

  // False: not within a minute.
  bool wait(const std::function<bool()>& condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), condition);
  }
  // The end of the revision's frame.
  std::optional<FrameEnd> wait_for_end(std::uint64_t revision) {
    std::optional<FrameEnd> found;
    wait([&] {
      for (const FrameEnd& end : ends) {
        if (end.tag.revision == revision) found = end;
      }
      return found.has_value();
    });
    return found;
  }
  template <class Read>
  auto read(const Read& get) {
    const std::lock_guard lock(mutex_);
    return get();
  }

  // Guarded by the sink's mutex: look through wait() or read().
  std::vector<FrameBegin> begins;
  std::vector<TileRecord> tiles;
  std::vector<FrameEnd> ends;
  std::vector<double> begin_times;         // now_s()
  std::vector<double> begin_cpu, end_cpu;  // process_cpu_s()
  std::vector<ResolvedTile> pixels;

  // Set before rendering.
  bool keep_pixels = false;
  std::atomic<bool> with_display = false;         // tiles of films have that layer
  std::function<void(const FrameTile&)> on_tile;  // called without the mutex
  std::atomic<std::size_t> backlog_tiles{0};

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
  FrameTag newest_;
};

}  // namespace helio
