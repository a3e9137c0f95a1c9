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
  tile.bytes.resize(bytes);
  return tile;
}

FrameEnd end(std::uint64_t revision, std::uint64_t frame) {
  FrameEnd end;
  end.tag = {revision, revision, frame};
  return end;
}

// The same of a preview.
FrameBegin begin_preview(std::uint64_t revision, std::uint64_t frame) {
  FrameBegin preview = begin(revision, frame);
  preview.preview = true;
  return preview;
}

// A whole preview of two tiles of 100 bytes.
void push_preview(OutboundQueue& queue, std::uint64_t revision, std::uint64_t frame) {
  queue.push(begin_preview(revision, frame));
  for (const int x : {0, 10}) queue.push(tile(revision, frame, x));
  queue.push(end(revision, frame));
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

TEST(OutboundQueue, VarianceIsDueUntilItWasSent) {
  OutboundQueue queue;
  constexpr int kEvery = 3;
  const auto send = [&](int x) {
    EncodedTile next = tile(1, 1, x);
    next.variance = queue.variance_due(next.tag, {x, 0}, kEvery);
    queue.push(next);
    return pop<EncodedTile>(queue).variance;
  };
  queue.push(begin(1, 1));
  pop<FrameBegin>(queue);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(send(0), i % kEvery == 0) << i;
  EXPECT_TRUE(send(10)) << "another place, of which nothing was sent";

  // One that is replaced while it waits was not sent.
  EncodedTile waits = tile(1, 1, 0);
  EXPECT_TRUE(queue.variance_due(waits.tag, {0, 0}, kEvery));
  queue.push(waits);
  EXPECT_TRUE(queue.variance_due(waits.tag, {0, 0}, kEvery));
  EXPECT_TRUE(send(0));
  EXPECT_FALSE(queue.variance_due(waits.tag, {0, 0}, kEvery));

  queue.push(begin(1, 2));
  EXPECT_TRUE(queue.variance_due({1, 1, 2}, {0, 0}, kEvery)) << "another frame";
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

// Pops a whole frame; its number.
std::uint64_t pop_frame(OutboundQueue& queue, std::size_t tiles) {
  const std::uint64_t frame = pop<FrameBegin>(queue).tag.frame;
  for (std::size_t i = 0; i < tiles; ++i) EXPECT_EQ(pop<EncodedTile>(queue).tag.frame, frame);
  const FrameReport report = pop<FrameReport>(queue);
  EXPECT_EQ(report.end.tag.frame, frame);
  EXPECT_EQ(report.bytes_sent, 100 * tiles);
  EXPECT_EQ(report.dropped_tiles, 0u);
  return frame;
}

TEST(OutboundQueue, APreviewThatHasBegunIsSentToItsEnd) {
  OutboundQueue queue;
  queue.push(begin_preview(1, 1));
  queue.push(tile(1, 1, 0));
  pop<FrameBegin>(queue);
  queue.drop_before(2);  // a newer view, twice
  queue.push(tile(1, 1, 10));
  EXPECT_TRUE(queue.wants({1, 1, 1}));
  queue.push(end(1, 1));
  queue.drop_before(3);
  push_preview(queue, 3, 2);
  queue.push(begin(3, 3));
  queue.push(tile(3, 3, 0));
  queue.push(end(3, 3));
  for (int i = 0; i < 2; ++i) EXPECT_EQ(pop<EncodedTile>(queue).tag.frame, 1u);
  EXPECT_EQ(pop<FrameReport>(queue).dropped_tiles, 0u);
  EXPECT_EQ(pop_frame(queue, 2), 2u);
  EXPECT_EQ(pop_frame(queue, 1), 3u);
  EXPECT_TRUE(queue.empty());
}

TEST(OutboundQueue, ANewerPreviewReplacesTheOneThatWaitsWhole) {
  OutboundQueue queue;
  push_preview(queue, 1, 1);
  pop<FrameBegin>(queue);  // the listener reads no further
  for (std::uint64_t i = 2; i <= 100; ++i) {
    queue.drop_before(i);
    push_preview(queue, i, 2 * i);
    queue.push(begin(i, 2 * i + 1));
    for (int x = 0; x < 50; x += 10) queue.push(tile(i, 2 * i + 1, x));
  }
  EXPECT_LE(queue.peak_bytes(), 2u * 200 + 500);
  EXPECT_EQ(queue.bytes(), queue.peak_bytes());
  EXPECT_FALSE(queue.wants({50, 50, 100}));
  for (int i = 0; i < 2; ++i) pop<EncodedTile>(queue);
  pop<FrameReport>(queue);
  EXPECT_EQ(pop_frame(queue, 2), 200u);
  EXPECT_EQ(pop<FrameBegin>(queue).tag.frame, 201u);
  EXPECT_EQ(queue.bytes(), 500u);
}

TEST(OutboundQueue, APreviewDropsTheFilmsTilesAndItsEndIsStillTold) {
  OutboundQueue queue;
  queue.push(begin(1, 1));
  for (const int x : {0, 10}) queue.push(tile(1, 1, x));
  pop<FrameBegin>(queue);
  pop<EncodedTile>(queue);
  queue.push(end(1, 1));
  push_preview(queue, 2, 2);
  queue.push(tile(1, 1, 20));
  const FrameReport film = pop<FrameReport>(queue);
  EXPECT_EQ(film.end.tag.frame, 1u);
  EXPECT_EQ(film.dropped_tiles, 1u);
  EXPECT_EQ(pop_frame(queue, 2), 2u);
  EXPECT_TRUE(queue.empty());
}

TEST(OutboundQueue, PreviewsCostCreditAndRate) {
  OutboundQueue queue;
  queue.limit_credit(0);
  push_preview(queue, 1, 1);
  pop<FrameBegin>(queue);
  EXPECT_FALSE(queue.pop(0).message);
  EXPECT_TRUE(queue.add_credit(1));
  pop<EncodedTile>(queue);
  EXPECT_FALSE(queue.pop(0).message);
  EXPECT_FALSE(queue.empty());
  queue.add_credit(100);
  queue.limit_rate(100.0);
  pop<EncodedTile>(queue, 10);  // 100 bytes take a second, less 0.1 s of burst
  pop<FrameReport>(queue, 10);
  push_preview(queue, 2, 2);
  pop<FrameBegin>(queue, 10.1);
  EXPECT_NEAR(queue.pop(10.1).wait_until_s, 10.9, 1e-9);
  pop<EncodedTile>(queue, 10.91);
}

TEST(OutboundQueue, ALostEndOfAPreviewHoldsNothingUp) {
  OutboundQueue queue;
  queue.push(begin_preview(1, 1));
  queue.push(tile(1, 1, 0));
  pop<FrameBegin>(queue);
  pop<EncodedTile>(queue);
  EXPECT_FALSE(queue.pop(0).message);
  EXPECT_FALSE(queue.empty()) << "a call that is to end waits for the preview's end";
  queue.push(begin(1, 2));
  queue.push(tile(1, 1, 10));
  const FrameReport lost = pop<FrameReport>(queue);
  EXPECT_EQ(lost.end.tag.frame, 1u);
  EXPECT_EQ(lost.end.reason, FrameEndReason::failed);
  EXPECT_EQ(pop<FrameBegin>(queue).tag.frame, 2u);
  EXPECT_TRUE(queue.empty());
}

TEST(OutboundQueue, CloseDropsPreviewsToo) {
  OutboundQueue queue;
  push_preview(queue, 1, 1);
  pop<FrameBegin>(queue);
  push_preview(queue, 2, 2);
  queue.close();
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.bytes(), 0u);
  push_preview(queue, 3, 3);
  EXPECT_FALSE(queue.pop(0).message);
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

}  // namespace
}  // namespace helio
