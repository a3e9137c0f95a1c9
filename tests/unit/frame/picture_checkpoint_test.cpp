// Checkpoints as bytes: what is damaged is refused, what is let through can be rendered.
#include "renderer/frame/picture_checkpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "adaptive_frames.h"
#include "fake_integrator.h"
#include "recording_sink.h"
#include "renderer/frame/checkpoint/checkpoint_clock.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio {
namespace {

using Bytes = std::vector<std::uint8_t>;

// The last checkpoint of a picture of so many samples.
Bytes checkpoint_of(const RenderSettings& settings, std::uint32_t count, double invalid_share = 0) {
  FakeIntegrator fake;
  fake.invalid_share = invalid_share;
  fake.noisy_from = 0.5f;
  RenderEngine engine(2);
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoopOptions options;
  Bytes last;
  RenderLoop* asked = nullptr;
  options.checkpoints = CheckpointOptions{.interval_s = 0, .keep = [&](auto checkpoint) {
                                            last.assign(checkpoint->encode().begin(), checkpoint->encode().end());
                                          }};
  const auto trace = [&](const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
    asked->checkpoint_soon();
    return fake.function()(job, cancel, film, stats);
  };
  RenderLoop loop(engine, trace, settings, samples(count), RenderRank::job, sink, options);
  asked = &loop;
  RenderLoop::Update update;
  update.view = view_at(7, 0);
  EXPECT_TRUE(sink->wait_for_end(loop.update(update)));
  return last;
}

Bytes traced_checkpoint(Integrator integrator, const RenderSettings& base) {
  Bytes last;
  RenderEngine engine(2);
  RenderSettings settings = base;
  settings.integrator = integrator;
  RenderLoopOptions options;
  RenderLoop* asked = nullptr;
  options.checkpoints = CheckpointOptions{.interval_s = 0, .keep = [&](auto checkpoint) {
                                            last.assign(checkpoint->encode().begin(), checkpoint->encode().end());
                                          }};
  options.make_tracer = [&](std::shared_ptr<const RenderScene> scene) {
    return [&asked, trace = path_tracer(std::move(scene))](const IntegrateJob& job, const CancelToken& cancel,
                                                           Film& film, TraceStats& stats) {
      if (asked) asked->checkpoint_soon();
      return trace(job, cancel, film, stats);
    };
  };
  test::LoopViews views(engine, test::build(test::lambert_room()), settings, options);
  asked = &views.loop();
  views.render(test::camera_at({0, 0, 0.95}, {0, -0.2, -1}, 75), 8);
  return last;
}

// Goes on with it to the end, whatever it says.
FrameEnd rendered_from(RenderEngine& engine, PictureCheckpoint checkpoint, const RenderSettings& settings,
                       std::uint32_t count) {
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoop loop(engine, FakeIntegrator().function(), settings, samples(count), RenderRank::job, sink, {});
  RenderLoop::Update update;
  update.view = view_at(7, 0);
  update.resume = std::make_shared<const PictureCheckpoint>(std::move(checkpoint));
  const std::uint64_t revision = loop.update(update);
  if (revision == 0) return {};
  const auto end = sink->wait_for_end(revision);
  EXPECT_TRUE(end) << "never ends";
  return end.value_or(FrameEnd{});
}

struct Kind {
  const char* name;
  RenderSettings settings;
  std::uint32_t samples;
  double invalid_share;
};

std::vector<Kind> kinds(int width, int height) {
  RenderSettings pt = film_of(width, height), rounds = adaptive(width, height);
  rounds.adaptive.min_samples = 8;
  RenderSettings region = pt;
  region.region = PixelRect{3, 2, width - 2, height - 1};
  return {{"pt", pt, 16, 0}, {"invalid", pt, 16, 0.1}, {"adaptive", rounds, 40, 0.05}, {"region", region, 16, 0}};
}

TEST(PictureCheckpoint, ComesBackAsItWas) {
  for (const Kind& kind : kinds(40, 24)) {
    const Bytes bytes = checkpoint_of(kind.settings, kind.samples, kind.invalid_share);
    const auto checkpoint = PictureCheckpoint::decode(bytes, kind.settings);
    ASSERT_TRUE(checkpoint) << kind.name << ": " << checkpoint.error().to_string();
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), checkpoint->encode().begin(), checkpoint->encode().end()));
    EXPECT_EQ(checkpoint->view_id(), 7u);
    EXPECT_GT(checkpoint->seconds(), 0);
    EXPECT_EQ(checkpoint->head().invalid, kind.invalid_share > 0) << kind.name;
    EXPECT_EQ(checkpoint->head().round.number > 0, kind.settings.mode == RenderMode::adaptive) << kind.name;
    EXPECT_EQ(helio::encode(checkpoint->head()).size(),
              std::size_t(bytes[12] | bytes[13] << 8 | bytes[14] << 16)) << kind.name;
    EXPECT_LE(bytes.size(), checkpoint_bytes(kind.settings));
  }
}

TEST(PictureCheckpoint, IsRefusedAtEveryLength) {
  for (const Kind& kind : kinds(16, 16)) {
    const Bytes bytes = checkpoint_of(kind.settings, kind.samples, kind.invalid_share);
    ASSERT_TRUE(PictureCheckpoint::decode(bytes, kind.settings).ok());
    for (std::size_t size = 0; size < bytes.size(); size += size < 2000 ? 1 : 7) {
      Bytes front(bytes.begin(), bytes.begin() + std::ptrdiff_t(size));
      const auto cut = PictureCheckpoint::decode(std::move(front), kind.settings);
      ASSERT_FALSE(cut) << kind.name << " " << size;
      EXPECT_EQ(cut.error().code, ErrorCode::invalid_argument);
      EXPECT_EQ(cut.error().where.rfind("checkpoint", 0), 0u) << cut.error().to_string();
    }
    // The same with a prefix that says so: sizes of lists and of the pixels are held against what is left.
    for (std::size_t size = 24; size < bytes.size(); size += size < 2000 ? 1 : 7) {
      Bytes cut(bytes.begin(), bytes.begin() + std::ptrdiff_t(size));
      const std::uint64_t all = size;
      std::memcpy(cut.data() + 16, &all, sizeof all);
      std::uint32_t head = 0;
      std::memcpy(&head, cut.data() + 12, sizeof head);
      head = std::min<std::uint32_t>(head, std::uint32_t(size - 24));
      std::memcpy(cut.data() + 12, &head, sizeof head);
      ASSERT_FALSE(PictureCheckpoint::decode(cut, kind.settings)) << kind.name << " " << size;
    }
    Bytes longer = bytes;
    longer.push_back(0);
    EXPECT_FALSE(PictureCheckpoint::decode(longer, kind.settings));
  }
}

TEST(PictureCheckpoint, SaysWhatDoesNotFit) {
  const RenderSettings settings = film_of(32, 24);
  const Bytes bytes = checkpoint_of(settings, 16);
  const auto refused = [](const Bytes& these, const RenderSettings& other) {
    auto result = PictureCheckpoint::decode(these, other);
    EXPECT_FALSE(result.ok());
    return result.ok() ? Error{} : result.error();
  };
  Bytes other = bytes;
  other[8] = 9;
  EXPECT_EQ(refused(other, settings).to_string(), "checkpoint.version: 9; allowed: 1");
  EXPECT_EQ(refused(other, settings).code, ErrorCode::failed_precondition);
  other = bytes;
  other[0] = 'h';
  EXPECT_EQ(refused(other, settings).to_string(), "checkpoint.magic: does not begin with HELIOPIC");
  EXPECT_EQ(refused(bytes, film_of(320, 240)).to_string(), "checkpoint.film: 32 x 24; allowed: 320 x 240");
  EXPECT_EQ(refused(bytes, film_of(320, 240)).code, ErrorCode::failed_precondition);
  RenderSettings part = settings;
  part.region = PixelRect{1, 2, 30, 20};
  EXPECT_EQ(refused(bytes, part).to_string(), "checkpoint.region: [0, 32) x [0, 24); allowed: [1, 30) x [2, 20)");
  RenderSettings seed = settings;
  seed.seed = 1;
  EXPECT_EQ(refused(bytes, seed).where, "checkpoint.settings");
  EXPECT_EQ(refused(bytes, seed).code, ErrorCode::failed_precondition);
  RenderSettings reusing = settings;
  reusing.mode = RenderMode::combined;
  EXPECT_EQ(refused(bytes, reusing).to_string(),
            "checkpoint: mode combined with variant bounded has none; allowed: modes pt and adaptive with variant "
            "bounded");

  // Pixels: a count that is not that of the block, a sum that is no number.
  const auto whole = PictureCheckpoint::decode(bytes, settings);
  ASSERT_TRUE(whole);
  const std::size_t pixels = std::size_t(whole->pixels() - whole->encode().data());
  other = bytes;
  other[pixels + 36] ^= 1;  // the count of half A of pixel (0, 0), 8 of 16 samples or a power of two before
  EXPECT_EQ(refused(other, settings).where, "checkpoint.samples of pixel (0, 0)");
  other = bytes;
  std::memset(other.data() + pixels + 40, 0xff, 8);
  EXPECT_EQ(refused(other, settings).to_string(),
            "checkpoint.sum of pixel (1, 0): is not finite; allowed: finite numbers");
}

// Bits that are turned are found or do no harm: such pictures come to their end.
TEST(PictureCheckpoint, SurvivesTurnedBits) {
  std::mt19937 random(1);
  RenderEngine engine(2);
  for (const Kind& kind : kinds(64, 40)) {
    const Bytes bytes = checkpoint_of(kind.settings, kind.samples, kind.invalid_share);
    int let_through = 0, rendered = 0;
    for (int i = 0; i < 1000; ++i) {
      Bytes turned = bytes;
      const int turns = 1 + i % 3;
      for (int t = 0; t < turns; ++t) {
        // Every other one in the head, where most is at stake.
        const std::size_t end = i % 2 == 0 ? std::min<std::size_t>(1200, turned.size()) : turned.size();
        turned[random() % end] ^= std::uint8_t(1u << random() % 8);
      }
      auto checkpoint = PictureCheckpoint::decode(std::move(turned), kind.settings);
      if (!checkpoint) {
        EXPECT_EQ(checkpoint.error().where.rfind("checkpoint", 0), 0u) << checkpoint.error().to_string();
        continue;
      }
      if (++let_through % 8 != 0) continue;
      ++rendered;
      const FrameEnd end = rendered_from(engine, std::move(checkpoint).value(), kind.settings, 64);
      EXPECT_NE(end.reason, FrameEndReason::failed) << end.message;
    }
    EXPECT_LT(let_through, 900) << kind.name;
    EXPECT_GT(rendered, 10) << kind.name;
  }
}

// Every field of the head that is no free number, by itself.
TEST(PictureCheckpoint, HoldsTheHeadToItsRanges) {
  RenderSettings settings = adaptive(40, 24);
  settings.adaptive.min_samples = 8;
  const auto whole = PictureCheckpoint::decode(checkpoint_of(settings, 40), settings);
  ASSERT_TRUE(whole);
  const auto refused = [&](const auto& change) -> std::string {
    PictureHead head = whole->head();
    change(head);
    const std::vector<std::uint8_t> bytes = helio::encode(head);
    std::span<const std::uint8_t> rest(bytes);
    const auto decoded = decode_head(rest, settings);
    return decoded ? "" : decoded.error().where;
  };
  EXPECT_EQ(refused([](PictureHead&) {}), "");
  EXPECT_EQ(refused([](PictureHead& h) { h.seconds = -1; }), "seconds");
  EXPECT_EQ(refused([](PictureHead& h) { h.seconds = std::numeric_limits<double>::quiet_NaN(); }), "seconds");
  EXPECT_EQ(refused([](PictureHead& h) { h.samples = ~0ull; }), "samples");
  EXPECT_EQ(refused([](PictureHead& h) { h.trace.first_invalid.x = 40; }), "trace.first_invalid.x");
  EXPECT_EQ(refused([](PictureHead& h) { h.trace.first_invalid.y = -1; }), "trace.first_invalid.y");
  EXPECT_EQ(refused([](PictureHead& h) { h.trace.first_invalid.half = 2; }), "trace.first_invalid.half");
  EXPECT_EQ(refused([](PictureHead& h) { h.measured.samples = ~0u; }), "measured.samples");
  EXPECT_EQ(refused([](PictureHead& h) { h.round.mean = std::numeric_limits<double>::infinity(); }), "round.mean");
  EXPECT_EQ(refused([](PictureHead& h) { h.round.first_samples = 1; }), "round.first_samples");
  EXPECT_EQ(refused([](PictureHead& h) { h.round.measured = h.samples + 1; }), "round.measured");
  EXPECT_EQ(refused([](PictureHead& h) { h.round.number = 0; }), "cells.top") << "there are rounds";
  EXPECT_EQ(refused([](PictureHead& h) { ++h.round.summary.top[1]; }), "round.top");
  EXPECT_EQ(refused([](PictureHead& h) { h.cells.clear(); }), "cells");
  EXPECT_EQ(refused([](PictureHead& h) { h.cells.pop_back(); }), "head");
  EXPECT_EQ(refused([](PictureHead& h) { h.cells[3].done[0] = ~0u; }), "cells.done");
  EXPECT_EQ(refused([](PictureHead& h) { h.cells[3].rendered = false; }), "cells.rendered");
  EXPECT_EQ(refused([](PictureHead& h) { h.cells[3].top[0] = Cell::kNoTop; }), "cells.top");
  EXPECT_EQ(refused([](PictureHead& h) { h.light_tiles.assign(2, 1); }), "light_tiles");
  EXPECT_EQ(refused([](PictureHead& h) { h.splats = true; }), "splats");
  EXPECT_EQ(refused([](PictureHead& h) { h.exponent = 2; }), "targets.exponent");
  EXPECT_EQ(refused([](PictureHead& h) { h.uniform = ~0u; }), "targets.uniform");
  EXPECT_EQ(refused([](PictureHead& h) { h.histogram[0].clear(); }), "targets.histogram");
  EXPECT_EQ(refused([](PictureHead& h) { h.histogram[1].resize(99); }), "head");
}

TEST(PictureCheckpoint, HoldsLightTilesToTheirRanges) {
  RenderSettings settings = test::loop_settings(40, 40, RenderMode::pt);
  settings.max_segments = 4;
  const Bytes bytes = traced_checkpoint(Integrator::pt_bdpt, settings);
  settings.integrator = Integrator::pt_bdpt;
  const auto whole = PictureCheckpoint::decode(bytes, settings);
  ASSERT_TRUE(whole) << whole.error().to_string();
  ASSERT_EQ(whole->head().light_tiles.size(), 4u);
  PictureHead head = whole->head();
  head.light_tiles[2] = 2;
  std::vector<std::uint8_t> changed = helio::encode(head);
  std::span<const std::uint8_t> rest(changed);
  EXPECT_EQ(decode_head(rest, settings).error().where, "light_tiles");
  head.light_tiles.assign(4, !head.splats);
  changed = helio::encode(head);
  rest = changed;
  EXPECT_EQ(decode_head(rest, settings).error().where, "splats");
  for (const Integrator integrator : {Integrator::bdpt, Integrator::photon}) {
    RenderSettings own = settings;
    own.integrator = integrator;
    const auto other = PictureCheckpoint::decode(traced_checkpoint(integrator, settings), own);
    ASSERT_TRUE(other) << other.error().to_string();
    EXPECT_EQ(other->head().splats, integrator == Integrator::bdpt);
  }
}

TEST(CheckpointClock, KeepsTheInterval) {
  CheckpointClock clock(10);
  clock.begin(100);
  EXPECT_FALSE(clock.due(109.9));
  EXPECT_TRUE(clock.due(110));
  clock.begun();
  clock.ended(0.01, 111);
  EXPECT_FALSE(clock.due(120.9));
  EXPECT_TRUE(clock.due(121));
}

TEST(CheckpointClock, TakesTwoPercentOfTheTimeAtMost) {
  CheckpointClock clock(1);
  clock.set_size(std::uint64_t(400e6));  // 0.1 s by assumption
  clock.begin(0);
  EXPECT_FALSE(clock.due(4.8));
  EXPECT_TRUE(clock.due(4.95));
  // 0.5 s of 25: the next begins after 24.5.
  clock.begun();
  clock.ended(0.5, 10);
  EXPECT_FALSE(clock.due(34.4));
  EXPECT_TRUE(clock.due(34.6));
}

TEST(CheckpointClock, AnswersThoseWhoAskedBefore) {
  CheckpointClock clock(0);
  clock.begin(0);
  EXPECT_FALSE(clock.due(1e9));
  clock.ask();
  EXPECT_TRUE(clock.due(1));
  clock.begun();  // and is stopped
  EXPECT_TRUE(clock.due(1));
  clock.begun();
  clock.ask();  // what is being copied is older
  clock.ended(0.1, 2);
  EXPECT_TRUE(clock.due(2));
  clock.begun();
  clock.ended(0.1, 3);
  EXPECT_FALSE(clock.due(1e9));
}

}  // namespace
}  // namespace helio
