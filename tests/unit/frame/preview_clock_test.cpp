#include "renderer/frame/preview_clock.h"

#include <gtest/gtest.h>

namespace helio::test {
namespace {

using Next = PreviewClock::Next;

TEST(PreviewClock, WithoutARateTheFilmBeginsAtOnce) {
  PreviewClock clock;
  EXPECT_FALSE(clock.on());
  clock.changed(5);
  EXPECT_EQ(clock.decide(), (PreviewClock::Decision{Next::film, 0}));
}

TEST(PreviewClock, AChangeMakesAPreviewDueAndTheFilmWaitsForRest) {
  PreviewClock clock;
  clock.set_rate(20);
  clock.changed(5);
  EXPECT_EQ(clock.decide().next, Next::preview);
  EXPECT_LE(clock.decide().at_s, 5);
  clock.begun(5);
  EXPECT_EQ(clock.decide(), (PreviewClock::Decision{Next::film, 5 + PreviewClock::kRestWait}));
}

TEST(PreviewClock, KeepsToItsRateAndTakesTheNewestView) {
  PreviewClock clock;
  clock.set_rate(20);
  clock.changed(5);
  clock.begun(5);
  clock.changed(5.01);
  clock.changed(5.02);
  EXPECT_EQ(clock.decide(), (PreviewClock::Decision{Next::preview, 5.05}));
  clock.begun(5.05);
  EXPECT_EQ(clock.decide(), (PreviewClock::Decision{Next::film, 5.02 + PreviewClock::kRestWait}));
}

TEST(PreviewClock, TheFilmDoesNotWaitForAPreviewThatTheRatePutsOff) {
  PreviewClock clock;
  clock.set_rate(2);
  clock.changed(5);
  clock.begun(5);
  clock.changed(5.2);
  EXPECT_EQ(clock.decide(), (PreviewClock::Decision{Next::film, 5.2 + PreviewClock::kRestWait}));
  clock.changed(5.45);
  EXPECT_EQ(clock.decide(), (PreviewClock::Decision{Next::preview, 5.5}));
  clock.film_begun();
  EXPECT_EQ(clock.decide().next, Next::film);
}

TEST(PreviewClock, SwitchedOffItForgetsWhatWasDue) {
  PreviewClock clock;
  clock.set_rate(20);
  clock.changed(5);
  clock.set_rate(0);
  EXPECT_EQ(clock.decide(), (PreviewClock::Decision{Next::film, 0}));
  clock.set_rate(20);
  EXPECT_EQ(clock.decide().next, Next::film);
}

}  // namespace
}  // namespace helio::test
