// The queue's rules, one by one.
#include "server/stream/outbound_queue.h"

#include <gtest/gtest.h>

namespace helio {
namespace {

FrameBegin begin(std::uint64_t revision, std::uint64_t frame) {
  FrameBegin begin;
  begin.tag = {revision, revision, frame};
  return begin;
}

EncodedTile tile(std::uint64_t revision, std::uint64_t frame, int x, std::uint32_t pass = 0, std::size_t bytes = 100) {
  EncodedTile tile;
  tile.tag = {revision, revision, frame};
  tile.window = {x, 0, x + 10, 10};
  tile.pass = pass;
  tile.exr.resize(bytes);
  return tile;
}

FrameEnd end(std::uint64_t revision, std::uint64_t frame) {
  FrameEnd end;
  end.tag = {revision, revision, frame};
  return end;
}

template <class T>
T pop(OutboundQueue& queue, double now = 0) {
  auto next = queue.pop(now);
  EXPECT_TRUE(next.message && std::holds_alternative<T>(*next.message));
  return next.message && std::holds_alternative<T>(*next.message) ? std::get<T>(std::move(*next.message)) : T();
}

TEST(OutboundQueue, OrderWithinAFrame) {
  OutboundQueue queue;
  queue.push(begin(1, 1));
  queue.push(tile(1, 1, 0));
  FrameProgress progress;
  progress.tag = {1, 1, 1};
  queue.push(progress);
  queue.push(Notice{NoticeSeverity::info, "n"});
  queue.push(Greeting{"hello"});
  EXPECT_EQ(pop<Greeting>(queue).message, "hello");
  pop<Notice>(queue);
  pop<FrameBegin>(queue);
  pop<FrameProgress>(queue);
  pop<EncodedTile>(queue);
  EXPECT_TRUE(queue.empty());
  queue.push(tile(1, 1, 10));
  queue.push(end(1, 1));
  EXPECT_FALSE(queue.empty());
  pop<EncodedTile>(queue);
  const FrameReport report = pop<FrameReport>(queue);
  EXPECT_EQ(report.bytes_sent, 200u);
  EXPECT_EQ(report.dropped_tiles, 0u);
  EXPECT_FALSE(queue.pop(0).message);
  EXPECT_TRUE(queue.empty());
}

TEST(OutboundQueue, NewerStateTakesTheOlderOnesPlace) {
  OutboundQueue queue;
  queue.push(begin(1, 1));
  for (const int x : {0, 10, 20}) queue.push(tile(1, 1, x, 1, 100));
  queue.push(tile(1, 1, 10, 2, 300));
  EXPECT_EQ(queue.tiles(), 3u);
  EXPECT_EQ(queue.bytes(), 500u);
  pop<FrameBegin>(queue);
  EXPECT_EQ(pop<EncodedTile>(queue).window.x0, 0);
  const EncodedTile second = pop<EncodedTile>(queue);
  EXPECT_EQ(second.window.x0, 10);
  EXPECT_EQ(second.pass, 2u);
  EXPECT_EQ(pop<EncodedTile>(queue).window.x0, 20);
  queue.push(end(1, 1));
  EXPECT_EQ(pop<FrameReport>(queue).dropped_tiles, 1u);
}

TEST(OutboundQueue, NewRevisionDropsOlderTilesEvenThoseThatComeLate) {
  OutboundQueue queue;
  queue.push(begin(1, 1));
  pop<FrameBegin>(queue);
  queue.push(tile(1, 1, 0));
  queue.drop_before(2);
  EXPECT_FALSE(queue.wants({1, 1, 1}));
  queue.push(tile(1, 1, 10));  // was being encoded meanwhile
  EXPECT_EQ(queue.tiles(), 0u);
  queue.push(end(1, 1));
  queue.push(begin(2, 2));
  queue.push(tile(1, 1, 20));
  queue.push(tile(2, 2, 0));
  EXPECT_EQ(pop<FrameReport>(queue).end.tag.revision, 1u) << "the listener knows of frame 1, so it hears of its end";
  EXPECT_EQ(pop<FrameBegin>(queue).tag.revision, 2u);
  EXPECT_EQ(pop<EncodedTile>(queue).tag.revision, 2u);
  EXPECT_FALSE(queue.pop(0).message);
}

TEST(OutboundQueue, FramesOfWhichNothingWasSentLeaveNoTrace) {
  OutboundQueue queue;
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    queue.push(begin(i, i));
    queue.push(tile(i, i, 0));
    queue.push(end(i, i));
  }
  EXPECT_EQ(pop<FrameBegin>(queue).tag.revision, 1000u);
  pop<EncodedTile>(queue);
  pop<FrameReport>(queue);
  EXPECT_TRUE(queue.empty());
}

TEST(OutboundQueue, HoldsAtMostOneFrameOfTiles) {
  OutboundQueue queue;
  for (std::uint64_t frame = 1; frame <= 20; ++frame) {
    queue.push(begin(frame, frame));
    for (std::uint32_t pass = 0; pass < 10; ++pass) {
      for (int x = 0; x < 500; x += 10) queue.push(tile(frame, frame, x, pass, 1000));
    }
    if (frame % 3 == 0) queue.pop(0);
  }
  EXPECT_LE(queue.peak_bytes(), 50u * 1000);
}

TEST(OutboundQueue, CreditHoldsTilesAndTheEnd) {
  OutboundQueue queue;
  queue.limit_credit(1);
  queue.push(begin(1, 1));
  queue.push(tile(1, 1, 0));
  queue.push(tile(1, 1, 10));
  queue.push(end(1, 1));
  pop<FrameBegin>(queue);
  pop<EncodedTile>(queue);
  EXPECT_FALSE(queue.pop(0).message);
  EXPECT_FALSE(queue.empty());
  EXPECT_TRUE(queue.add_credit(1));
  pop<EncodedTile>(queue);
  pop<FrameReport>(queue);
  OutboundQueue without;
  EXPECT_FALSE(without.add_credit(1));
}

TEST(OutboundQueue, RateTellsWhenToComeBack) {
  OutboundQueue queue;
  queue.limit_rate(1000.0);
  queue.push(begin(1, 1));
  for (int x = 0; x < 30; x += 10) queue.push(tile(1, 1, x, 0, 500));
  pop<FrameBegin>(queue, 10);
  pop<EncodedTile>(queue, 10);  // 0.1 s of burst, then 500 bytes take half a second
  const auto wait = queue.pop(10.1);
  EXPECT_FALSE(wait.message);
  EXPECT_NEAR(wait.wait_until_s, 10.4, 1e-9);
  pop<EncodedTile>(queue, 10.41);
  EXPECT_FALSE(queue.pop(10.5).message);
  queue.limit_rate(std::nullopt);
  pop<EncodedTile>(queue, 10.5);
}

TEST(OutboundQueue, ClosedQueueTakesNothing) {
  OutboundQueue queue;
  queue.push(begin(1, 1));
  queue.close();
  queue.push(begin(2, 2));
  queue.push(tile(2, 2, 0));
  queue.push(Notice{});
  EXPECT_TRUE(queue.empty());
  EXPECT_FALSE(queue.pop(0).message);
}

FrameBegin preview_begin(std::uint64_t revision, std::uint64_t frame) {
  FrameBegin preview = begin(revision, frame);
  preview.preview = true;
  return preview;
}

TEST(OutboundQueue, APreviewOfWhichSomethingWasSentIsSentToItsEnd) {
  OutboundQueue queue;
  queue.push(preview_begin(1, 1));
  queue.push(tile(1, 1, 0));
  pop<FrameBegin>(queue);
  queue.push(tile(1, 1, 10));
  queue.drop_before(5);
  EXPECT_TRUE(queue.wants({1, 1, 1}));
  queue.push(tile(1, 1, 20));
  queue.push(end(1, 1));
  queue.push(begin(5, 2));  // the film of a newer view
  queue.push(tile(5, 2, 0));
  EXPECT_EQ(queue.bytes(), 400u);
  for (const int x : {0, 10, 20}) EXPECT_EQ(pop<EncodedTile>(queue).window.x0, x);
  EXPECT_EQ(pop<FrameReport>(queue).bytes_sent, 300u);
  EXPECT_EQ(pop<FrameBegin>(queue).tag.frame, 2u);
  EXPECT_EQ(pop<EncodedTile>(queue).tag.frame, 2u);
  EXPECT_EQ(queue.bytes(), 0u);
}

TEST(OutboundQueue, APreviewThatWaitsIsReplacedWholeByANewerOne) {
  OutboundQueue queue;
  for (std::uint64_t frame = 1; frame <= 6; ++frame) {
    queue.push(preview_begin(frame, frame));
    for (int x = 0; x < 100; x += 10) queue.push(tile(frame, frame, x));
    queue.push(end(frame, frame));
    if (frame == 1) {
      EXPECT_EQ(pop<FrameBegin>(queue).tag.frame, 1u);
    }
    EXPECT_LE(queue.bytes(), 2000u);  // two previews at most, whoever reads or not
  }
  EXPECT_FALSE(queue.wants({3, 3, 3}));
  for (int x = 0; x < 100; x += 10) EXPECT_EQ(pop<EncodedTile>(queue).tag.frame, 1u);
  EXPECT_EQ(pop<FrameReport>(queue).end.tag.frame, 1u);
  EXPECT_EQ(pop<FrameBegin>(queue).tag.frame, 6u);
  for (int x = 0; x < 100; x += 10) EXPECT_EQ(pop<EncodedTile>(queue).tag.frame, 6u);
  EXPECT_EQ(pop<FrameReport>(queue).end.tag.frame, 6u);
  EXPECT_TRUE(queue.empty());
}

TEST(OutboundQueue, TheEndOfTheFilmBeforeComesAheadOfAPreview) {
  OutboundQueue queue;
  queue.push(begin(1, 1));
  queue.push(tile(1, 1, 0));
  pop<FrameBegin>(queue);
  queue.push(end(1, 1));
  queue.drop_before(2);
  queue.push(preview_begin(2, 2));
  queue.push(tile(2, 2, 0));
  EXPECT_EQ(pop<FrameReport>(queue).dropped_tiles, 1u);
  EXPECT_EQ(pop<FrameBegin>(queue).tag.frame, 2u);
  queue.close();
  EXPECT_EQ(queue.bytes(), 0u);
  EXPECT_FALSE(queue.pop(0).message);
}

TEST(OutboundQueue, PreviewsCostCreditAndRate) {
  OutboundQueue queue;
  queue.limit_credit(1);
  queue.push(preview_begin(1, 1));
  for (int x = 0; x < 30; x += 10) queue.push(tile(1, 1, x));
  pop<FrameBegin>(queue);
  pop<EncodedTile>(queue);
  EXPECT_FALSE(queue.pop(0).message);
  EXPECT_TRUE(queue.add_credit(5));
  queue.limit_rate(100.0);
  pop<EncodedTile>(queue, 10);
  EXPECT_GT(queue.pop(10).wait_until_s, 10);
}

}  // namespace
}  // namespace helio
