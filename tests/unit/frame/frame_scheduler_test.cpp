#include "renderer/frame/frame_scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <ostream>
#include <vector>

namespace helio {

void print(const char* when, const std::vector<StageRequest>& stages, std::ostream& out) {
  const StageRequest none(StageId::reproject);
  for (const StageRequest& stage : stages) {
    const auto& [id, until_s, allocation, first_samples] = stage;
    out << " " << when << ":" << to_string(id);
    if (until_s != none.until_s) out << "<" << until_s;
    if (allocation != none.allocation)
      out << "(" << allocation.mean << "," << allocation.iteration << (allocation.fill ? ",fill)" : ")");
    if (first_samples) out << "(first_samples)";
  }
}

// Every field that differs from its default. One more field does not compile until it is told here.
void PrintTo(const FramePlan& plan, std::ostream* out) {
  const auto& [revision, before, target, round, by_tile, deadline_s, mean_samples, after, publish, final, end] = plan;
  const FramePlan none;
  *out << "A" << target[0] << " B" << target[1];
  if (revision != none.revision) *out << " revision:" << revision;
  print("before", before, *out);
  if (round) *out << " round";
  if (by_tile) *out << " by_tile";
  if (deadline_s != none.deadline_s) *out << " deadline:" << deadline_s;
  if (mean_samples != none.mean_samples) *out << " mean_samples:" << mean_samples;
  print("after", after, *out);
  if (publish != none.publish) *out << (publish == Publish::early ? " publish_early" : " publish_round");
  if (final) *out << " final";
  if (end) *out << " end:" << to_string(*end);
}

namespace {

FramePlan integrate(std::uint32_t a, std::uint32_t b, bool measure) {
  FramePlan plan;
  plan.target[0] = a;
  plan.target[1] = b;
  if (measure) plan.after.push_back(StageId::measure);
  return plan;
}

FramePlan first_look() {
  FramePlan plan = integrate(1, 0, false);
  plan.publish = Publish::early;
  return plan;
}

FramePlan show() {
  FramePlan plan;
  plan.publish = Publish::round;
  return plan;
}

FramePlan finish(FrameEndReason reason, bool measure = false) {
  FramePlan plan = show();
  if (measure) plan.after.push_back(StageId::measure);
  plan.final = true;
  plan.end = reason;
  return plan;
}

FrameState at(std::uint32_t a, std::uint32_t b) {
  FrameState state;
  state.done[0] = a;
  state.done[1] = b;
  state.published = a > 0;
  state.published_samples = a + b;
  state.measured.samples = a + b;
  return state;
}

FrameState with_error(FrameState state, double rmse, double relmse) {
  state.measured.samples = state.total();
  state.measured.error.rmse = rmse;
  state.measured.error.relmse = relmse;
  state.measured.error.known = true;
  return state;
}

TEST(FrameScheduler, BeginsWithHalfAThenBThenDoubles) {
  const FrameScheduler scheduler({}, {});
  EXPECT_EQ(scheduler.plan_next(FrameState{}, 0, 0, 0), first_look());
  EXPECT_EQ(scheduler.plan_next(at(1, 0), 0, 0, 0), integrate(1, 1, true));
  EXPECT_EQ(scheduler.plan_next(at(1, 1), 0, 0, 0), integrate(2, 2, true));
  EXPECT_EQ(scheduler.plan_next(at(2, 2), 0, 0, 0), integrate(4, 4, true));
  EXPECT_EQ(scheduler.plan_next(at(5, 5), 0, 0, 0), integrate(8, 8, true));
}

// Light paths of any tile land on all others: none is shown alone.
TEST(FrameScheduler, TilesThatAreNotDoneAloneAreShownTogether) {
  FrameState state;
  state.tiles_alone = false;
  FramePlan plan = first_look();
  plan.publish = Publish::round;
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0), plan);
  Budget budget;
  budget.samples = 1;
  plan.final = true;
  EXPECT_EQ(FrameScheduler(budget, {}).plan_next(state, 0, 0, 0), plan);
  state.reproject_due = state.transfer_prepared = true;
  plan.before = {StageId::reproject};
  EXPECT_EQ(FrameScheduler(budget, {}).plan_next(state, 0, 0, 0), plan);
}

// What is chosen decides whether tiles can be shown alone, so nothing is traced before.
TEST(FrameScheduler, ChoosesBeforeTheFirstSample) {
  FrameState state;
  state.tiles_alone = false;
  state.choice_due = true;
  state.reproject_due = state.transfer_prepared = true;
  FramePlan plan;
  plan.before = {StageId::reproject, StageId::choose};
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0), plan);
  state.reproject_due = false;
  plan.before = {StageId::choose};
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0), plan);
  // At most a quarter of a time budget.
  Budget budget;
  budget.time_s = 8;
  state.begun_s = 100;
  plan.before[0].until_s = 102;
  plan.deadline_s = 108;
  EXPECT_EQ(FrameScheduler(budget, {}).plan_next(state, 0, 0, 100), plan);
}

TEST(FrameScheduler, CarriesTheRevision) {
  FrameState state;
  state.revision = 41;
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0).revision, 41u);
}

TEST(FrameScheduler, PublishesAtPowersOfTwoAndByTheClock) {
  const FrameScheduler scheduler({}, {});
  FrameState state = at(2, 2);
  state.published_samples = 2;
  state.published_s = 10;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 10.001), show());
  state = at(3, 3);
  state.published_samples = 4;
  state.published_s = 10;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 10.2), integrate(4, 4, true));
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 10.25), show());
  // An old view is shown less often: every 1/16 of its age.
  EXPECT_EQ(scheduler.plan_next(state, 160, 0, 19.9), integrate(4, 4, true));
  EXPECT_EQ(scheduler.plan_next(state, 160, 0, 20), show());
}

TEST(FrameScheduler, BacklogPutsPublicationOff) {
  const FrameScheduler scheduler({}, {});
  FrameState state = at(2, 2);
  state.tiles = 10;
  state.published_samples = 2;
  EXPECT_EQ(scheduler.plan_next(state, 0, 5, 0.3), integrate(4, 4, true));
  EXPECT_EQ(scheduler.plan_next(state, 0, 5, 0.63), show());  // 0.25 (1 + 3 * 5/10) = 0.625
  EXPECT_EQ(scheduler.plan_next(state, 0, 10, 1e6), integrate(4, 4, true));
}

TEST(FrameScheduler, BytesPerSecondPacePublicationButNotTheEnd) {
  Budget budget;
  budget.bytes_per_second = 1e6;
  budget.samples = 8;
  const FrameScheduler scheduler(budget, {});
  FrameState state = at(2, 2);
  state.publish_bytes = 3e6;
  state.published_samples = 2;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 2.9), integrate(4, 4, true));
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 3), show());
  state = at(4, 4);
  state.published_samples = 2;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0.1), finish(FrameEndReason::samples));
}

TEST(FrameScheduler, RepublishShowsAtOnce) {
  FrameState state = at(3, 3);
  state.republish = true;
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 1000, 0), show());
  EXPECT_EQ(FrameScheduler({}, {false}).plan_next(state, 0, 0, 0), show());
}

TEST(FrameScheduler, SampleBudgetIsExact) {
  for (const std::uint32_t samples : {1u, 2u, 3u, 4u, 5u, 7u, 8u, 100u, 1023u}) {
    for (const bool passes : {true, false}) {
      Budget budget;
      budget.samples = samples;
      const FrameScheduler scheduler(budget, {passes});
      FrameState state;
      FramePlan plan;
      int steps = 0;
      for (; !plan.end && steps < 100; ++steps) {
        plan = scheduler.plan_next(state, 0, 0, 0);
        for (int h = 0; h < kHalves; ++h) state.done[h] = std::max(state.done[h], plan.target[h]);
        if (plan.asks(StageId::measure)) state.measured.samples = state.total();
        if (plan.publish != Publish::none) {
          EXPECT_TRUE(passes || plan.final);
          state.published = true;
          state.published_samples = state.total();
          state.published_final = plan.final;
        }
      }
      ASSERT_LT(steps, 100);
      EXPECT_EQ(*plan.end, FrameEndReason::samples);
      EXPECT_EQ(state.done[0], samples - samples / 2);
      EXPECT_EQ(state.done[1], samples / 2);
      EXPECT_TRUE(state.published_final);
      EXPECT_TRUE(samples == 1 || state.measured.samples == samples) << "the end has no error estimate";
    }
  }
}

TEST(FrameScheduler, OneSampleIsFinalAtOnce) {
  Budget budget;
  budget.samples = 1;
  FramePlan plan = first_look();
  plan.final = true;
  EXPECT_EQ(FrameScheduler(budget, {}).plan_next(FrameState{}, 0, 0, 0), plan);
}

TEST(FrameScheduler, UnlimitedEndsAtTheLargestCount) {
  const FrameScheduler scheduler({}, {});
  EXPECT_EQ(scheduler.plan_next(at(kMaxSamplesPerPixel / 2, kMaxSamplesPerPixel / 2), 0, 0, 0),
              finish(FrameEndReason::samples));
}

TEST(FrameScheduler, TimeBudgetKeepsRoomForTheEnd) {
  Budget budget;
  budget.time_s = 2;
  const FrameScheduler scheduler(budget, {});
  FrameState state = at(4, 4);
  state.begun_s = 100;
  state.measure_seconds = 0.01;
  state.publish_seconds = 0.04;
  state.sample_seconds = 0.05;  // 0.1 a pair; 0.25 of a plan hold two
  FramePlan plan = integrate(6, 6, false);
  plan.deadline_s = 102 - (0.01 + 0.04);
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 100.5), plan);
  plan = integrate(5, 5, false);  // 0.15 left: one pair fits
  plan.deadline_s = 102 - (0.01 + 0.04);
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 101.8), plan);
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 101.951), finish(FrameEndReason::time));
}

TEST(FrameScheduler, TimeBudgetCanEndBeforeTheFirstSample) {
  Budget budget;
  budget.time_s = 1;
  EXPECT_EQ(FrameScheduler(budget, {}).plan_next(FrameState{}, 0, 0, 1.5), finish(FrameEndReason::time));
}

TEST(FrameScheduler, EndMeasuresWhatItShows) {
  Budget budget;
  budget.time_s = 1;
  FrameState state = at(5, 5);
  state.measured.samples = 8;
  EXPECT_EQ(FrameScheduler(budget, {}).plan_next(state, 0, 0, 1.5), finish(FrameEndReason::time, true));
}

TEST(FrameScheduler, FiltersWhatItShowsOnce) {
  FrameState state = at(4, 4);
  state.display_due = true;
  state.published_samples = 4;  // so that a publication is due
  FramePlan filtered = show();
  filtered.after.push_back(StageId::display);
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0), filtered);
  state.display_due = false;
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0), show());

  Budget budget;
  budget.samples = 8;
  state.display_due = true;
  FramePlan end = finish(FrameEndReason::samples);
  end.after.push_back(StageId::display);
  EXPECT_EQ(FrameScheduler(budget, {}).plan_next(state, 0, 0, 0), end);
  state.published_final = true;  // nothing is left to show
  EXPECT_FALSE(FrameScheduler(budget, {}).plan_next(state, 0, 0, 0).asks(StageId::display));
}

TEST(FrameScheduler, FilteringTakesATenthOfTheTimeBetweenPublications) {
  FrameState state = at(5, 5);
  state.published = true;
  state.published_samples = 8;
  state.published_s = 100;
  state.display_due = true;
  state.display_seconds = 0.1;
  const FrameScheduler scheduler({}, {true, 0.25});
  const auto shows_at = [&](double now_s) { return scheduler.plan_next(state, 1, 0, now_s).publish == Publish::round; };
  EXPECT_TRUE(shows_at(100.3));  // the first is filtered as early as another would be
  state.displayed = 8;
  for (const std::uint32_t samples : {5u, 8u}) {  // 16 is a power of two
    state.done[0] = state.done[1] = samples;
    EXPECT_FALSE(shows_at(100.9)) << samples;
    EXPECT_TRUE(shows_at(101.1)) << samples;
  }
  state.display_due = false;
  EXPECT_TRUE(shows_at(100.3));
}

TEST(FrameScheduler, ATimeBudgetHoldsTheFilterOfItsLastPicture) {
  Budget budget;
  budget.time_s = 2;
  FrameState state = at(5, 5);
  state.published_samples = 10;
  const auto ends_at = [&](double now_s) {
    return FrameScheduler(budget, {}).plan_next(state, 0, 0, now_s).end.has_value();
  };
  EXPECT_FALSE(ends_at(1.6));
  state.display_seconds = 0.5;  // though there is nothing to filter yet
  EXPECT_FALSE(ends_at(1.4));
  EXPECT_TRUE(ends_at(1.6));
}

TEST(FrameScheduler, PlansLastAboutTheInterval) {
  const FrameScheduler scheduler({}, {});
  FrameState state = at(1024, 1024);
  state.sample_seconds = 0.025;  // 0.05 a pair
  EXPECT_EQ(scheduler.plan_next(state, 1, 0, 0), integrate(1029, 1029, false));
  state.sample_seconds = 3;  // one pair outlasts any interval
  EXPECT_EQ(scheduler.plan_next(state, 1, 0, 0), integrate(1025, 1025, false));
}

TEST(FrameScheduler, ErrorEndsTheFrame) {
  Budget budget;
  budget.error = 0.1;
  const FrameScheduler scheduler(budget, {});
  EXPECT_EQ(scheduler.plan_next(with_error(at(8, 8), 0.1, 9), 0, 0, 0), finish(FrameEndReason::error));
  EXPECT_EQ(scheduler.plan_next(with_error(at(8, 8), 0.101, 0), 0, 0, 0).end, std::nullopt);
}

TEST(FrameScheduler, ErrorIsNotBelievedTooEarlyNorWhenNothingShines) {
  Budget budget;
  budget.error = 0.1;
  const FrameScheduler scheduler(budget, {});
  EXPECT_EQ(scheduler.plan_next(with_error(at(4, 4), 0, 0), 0, 0, 0), integrate(8, 8, true));
  FrameState black = with_error(at(64, 64), 0, 0);
  black.measured.error.unproven = 1;
  black.measured.error.hidden_rmse = black.measured.error.hidden_relmse = std::numeric_limits<double>::infinity();
  EXPECT_EQ(scheduler.plan_next(black, 0, 0, 0), integrate(128, 128, true));
  // What black parts may hide counts as if it had been seen: 0.06 and 0.09 make more than 0.1.
  FrameState hiding = with_error(at(64, 64), 0.06, 0);
  hiding.measured.error.hidden_rmse = 0.09;
  EXPECT_FALSE(scheduler.plan_next(hiding, 0, 0, 0).end);
  hiding.measured.error.hidden_rmse = 0.07;
  EXPECT_EQ(scheduler.plan_next(hiding, 0, 0, 0).end, FrameEndReason::error);
  FrameState unknown = with_error(at(64, 64), 0, 0);
  unknown.measured.error.known = false;
  EXPECT_EQ(scheduler.plan_next(unknown, 0, 0, 0), integrate(128, 128, true));
  FrameState stale = with_error(at(8, 8), 0.01, 0);
  stale.done[0] = stale.done[1] = 9;
  stale.published_samples = 18;
  EXPECT_FALSE(scheduler.plan_next(stale, 0, 0, 0).end);
}

TEST(FrameScheduler, ErrorBudgetAimsAtTheCountThatIsNeeded) {
  Budget budget;
  budget.error = 0.1;
  const FrameScheduler scheduler(budget, {});
  // Variance is 1.44x the target at 32 samples; falling as 1/n^3 it meets it at 36.1. One half may be a sample ahead.
  EXPECT_EQ(scheduler.plan_next(with_error(at(16, 16), 0.12, 0), 0, 0, 0), integrate(19, 18, true));
  EXPECT_EQ(scheduler.plan_next(with_error(at(19, 18), 0.101, 0), 0, 0, 0), integrate(19, 19, true));
  // Not further than the next power of two.
  EXPECT_EQ(scheduler.plan_next(with_error(at(16, 16), 0.5, 0), 0, 0, 0), integrate(32, 32, true));
  // Almost there: steps do not get endlessly small.
  EXPECT_EQ(scheduler.plan_next(with_error(at(512, 512), 0.100001, 0), 0, 0, 0), integrate(528, 528, true));
}

// Runs the scheduler against an ideal picture whose error falls as error_at_1 n^-decay: it must stop with an error
// between 0.8x and 1.0x of the target.
TEST(FrameScheduler, ErrorBudgetEndsCloseToItsTarget) {
  for (const double decay : {0.5, 0.6, 0.75, 0.9}) {
    for (const double target : {0.2, 0.05, 0.03, 0.011}) {
      Budget budget;
      budget.error = target;
      const FrameScheduler scheduler(budget, {false});
      FrameState state;
      FramePlan plan;
      int estimates = 0;
      while (!plan.end && estimates < 100) {
        plan = scheduler.plan_next(state, 0, 0, 0);
        for (int h = 0; h < kHalves; ++h) state.done[h] = std::max(state.done[h], plan.target[h]);
        if (!plan.asks(StageId::measure)) continue;
        ++estimates;
        state = with_error(state, std::pow(state.total(), -decay), 0);
      }
      const double error = state.measured.error.rmse;
      EXPECT_EQ(plan.end, FrameEndReason::error);
      EXPECT_LE(error, target);
      if (state.total() > kMinSamplesForError) {
        EXPECT_GE(error, 0.8 * target) << decay << " " << target << " n " << state.total();
      }
      EXPECT_LT(estimates, 25);
    }
  }
}

// Errors that fall as n^-decay, up and down by a fifth.
double uneven_error(std::uint32_t samples, double decay) {
  return std::pow(samples, -decay) * (1 + 0.2 * std::sin(17.0 * samples));
}

// The counts at which a picture's error is looked at, and at the end the count that it ends with. A sample of every
// pixel takes so long; `shown`: with publications between the plans.
std::vector<std::uint32_t> course_of_errors(const Budget& budget, double sample_seconds, bool shown, double decay) {
  const FrameScheduler scheduler(budget, {.passes = shown, .interval_s = 0.1});
  FrameState state;
  std::vector<std::uint32_t> course;
  double now = 0;
  for (int plans = 0; plans < 100000; ++plans) {
    state.sample_seconds = state.total() > 0 ? sample_seconds : 0;
    const FramePlan plan = scheduler.plan_next(state, now, 0, now);
    const std::uint32_t before = state.total();
    for (int h = 0; h < kHalves; ++h) state.done[h] = std::max(state.done[h], plan.target[h]);
    now += sample_seconds * double(state.total() - before) + 1e-3;
    if (plan.asks(StageId::measure)) {
      course.push_back(state.total());
      state = with_error(state, uneven_error(state.total(), decay), 0);
    }
    if (plan.publish != Publish::none) {
      state.published = true;
      state.published_samples = state.total();
      state.published_s = now;
    }
    if (plan.end) break;
  }
  course.push_back(state.total());
  return course;
}

// A clock that is slow cuts plans short: the picture is the same.
TEST(FrameScheduler, TheCourseOfAnErrorBudgetDoesNotDependOnTime) {
  std::size_t looks = 0;
  for (const double decay : {0.4, 0.5, 0.7}) {
    for (const double target : {0.1, 0.031, 0.013}) {
      Budget budget;
      budget.error = target;
      for (const auto limit : {kMaxSamplesPerPixel, 1001u}) {
        budget.samples = limit;
        const auto course = course_of_errors(budget, 0, false, decay);
        looks += course.size();
        for (const double sample_seconds : {1e-4, 1e-3, 0.007, 0.03, 0.1, 0.4, 100.0}) {
          for (const bool shown : {false, true}) {
            EXPECT_EQ(course_of_errors(budget, sample_seconds, shown, decay), course)
                << "decay " << decay << " target " << target << " sample " << sample_seconds << " s";
          }
        }
      }
    }
  }
  EXPECT_GT(looks, 18u * 9) << "too few looks for the clock to come between them";
}

TEST(FrameScheduler, KeptFilmIsShownFirst) {
  FrameState state = at(8, 8);
  state.published = false;
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0), show());
  // Some tiles were never reached: the rest is shown as it comes.
  state = FrameState{};
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0), first_look());
}

TEST(FrameScheduler, JobsShowTheEndAlone) {
  Budget budget;
  budget.samples = 4;
  const FrameScheduler scheduler(budget, {false});
  EXPECT_EQ(scheduler.plan_next(FrameState{}, 0, 0, 0), integrate(1, 1, true));
  FrameState state = at(1, 1);
  state.published = false;
  EXPECT_EQ(scheduler.plan_next(state, 100, 0, 100), integrate(2, 2, true));
  EXPECT_EQ(scheduler.plan_next(at(2, 2), 100, 0, 100), finish(FrameEndReason::samples));
}

TEST(FrameScheduler, BudgetUsedIsTheLargestShare) {
  Budget budget;
  const FrameState state = with_error(at(16, 16), 0.2, 0);
  EXPECT_EQ(FrameScheduler(budget, {}).budget_used(state, 5), 0);
  budget.samples = 64;
  EXPECT_DOUBLE_EQ(FrameScheduler(budget, {}).budget_used(state, 5), 0.5);
  budget.time_s = 8;
  EXPECT_DOUBLE_EQ(FrameScheduler(budget, {}).budget_used(state, 5), 5.0 / 8);
  budget.error = 0.19;  // 0.95^2 of the samples needed
  EXPECT_NEAR(FrameScheduler(budget, {}).budget_used(state, 5), 0.9025, 1e-12);
  EXPECT_EQ(FrameScheduler(budget, {}).budget_used(state, 50), 1);
}

// ---- mode adaptive
// ---------------------------------------------------------------------------------------------------

AllocationSettings pilot_of(std::uint32_t samples) {
  AllocationSettings settings;
  settings.min_samples = samples;
  return settings;
}

FramePlan allocate(const AllocationRequest& request) {
  FramePlan plan;
  plan.round = true;
  plan.before.push_back(StageId::allocate);
  plan.before.back().allocation = request;
  return plan;
}

FramePlan levels(std::uint32_t both, bool measure) {
  FramePlan plan = integrate(both, both, measure);
  plan.round = true;
  return plan;
}

FramePlan carry() {
  FramePlan plan;
  plan.before = {StageId::reproject};
  return plan;
}

FramePlan of_mean(FramePlan plan, std::uint32_t mean_samples) {
  plan.mean_samples = mean_samples;
  return plan;
}

// A round of 100 pixels, half of which go from 8 to 16 samples of each half, the others to 64.
FrameState in_round(std::uint32_t level) {
  FrameState state = at(level, level);
  state.round.number = 1;
  state.round.pixels = 100;
  state.round.mean = 40;
  for (int h = 0; h < kHalves; ++h) {
    RoundSummary& round = state.round.summary;
    round.top[h] = 64;
    round.by_octave[h][3] = 800;      // levels 8 to 15: everyone
    round.by_octave[h][4] = 50 * 16;  // 16 to 31: half of them
    round.by_octave[h][5] = 50 * 32;
  }
  state.round.samples = 2 * 100 * 8;
  state.round.measured = state.round.published = state.round.samples;
  return state;
}

TEST(AdaptiveScheduler, CountsAreUniformUntilThePilotIsDone) {
  const FrameScheduler scheduler({}, {.passes = false}, pilot_of(16));
  EXPECT_EQ(scheduler.plan_next(at(4, 4), 0, 0, 0), integrate(8, 8, true));
  EXPECT_EQ(scheduler.plan_next(at(8, 8), 0, 0, 0), allocate({.mean = 16}));
}

TEST(AdaptiveScheduler, ARoundStopsAtTheBudget) {
  Budget budget;
  budget.samples = 20;
  EXPECT_EQ(FrameScheduler(budget, {.passes = false}, pilot_of(16)).plan_next(at(8, 8), 0, 0, 0),
            allocate({.mean = 10}));
  budget.samples = 16;
  EXPECT_EQ(FrameScheduler(budget, {.passes = false}, pilot_of(16)).plan_next(at(8, 8), 0, 0, 0),
            finish(FrameEndReason::samples));
  // 4 s are left, a sample of one half everywhere takes 1 s: two more of each half.
  Budget time;
  time.time_s = 20;
  FrameState state = at(8, 8);
  state.sample_seconds = 1;
  EXPECT_EQ(FrameScheduler(time, {.passes = false}, pilot_of(16)).plan_next(state, 0, 0, 16), allocate({.mean = 10}));
}

TEST(AdaptiveScheduler, TheFirstRoundsTowardsAnErrorAreShort) {
  Budget error;
  error.error = 1;
  const FrameScheduler scheduler(error, {.passes = false}, pilot_of(16));
  // The variance has to come down to a fourth; then by a tenth.
  FramePlan plan = scheduler.plan_next(with_error(at(8, 8), 2, 0), 0, 0, 0);
  ASSERT_TRUE(plan.asks(StageId::allocate));
  EXPECT_EQ(plan, allocate({.mean = plan.before[0].allocation.mean}));
  EXPECT_NEAR(plan.before[0].allocation.mean, 8 * std::pow(4 * 1.02, 0.125), 1e-9);
  const double decay[] = {8, 4, 2, 1, 1};
  for (std::uint32_t round = 1; round < std::size(decay); ++round) {
    FrameState state = in_round(64);
    state.round.number = round;
    state.round.samples = state.round.measured = state.round.published = 2 * 100 * 40;
    state = with_error(state, std::sqrt(1.1), 0);
    plan = scheduler.plan_next(state, 0, 0, 0);
    ASSERT_TRUE(plan.asks(StageId::allocate)) << round;
    EXPECT_EQ(plan, allocate({.mean = plan.before[0].allocation.mean}));
    EXPECT_NEAR(plan.before[0].allocation.mean,
                40 * std::max(1 + 1.0 / 32, std::pow(1.1 * 1.02, 1 / decay[round])), 1e-9)
        << round;
  }
}

TEST(AdaptiveScheduler, LevelsOfARoundAreCutByTime) {
  const FrameScheduler scheduler({}, {.passes = false}, pilot_of(16));
  FrameState state = in_round(8);
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), levels(64, true)) << "nothing is known of the cost";
  // 100 samples take 0.05 s, a plan lasts 1 s: 2,000 of the 6,400; both halves of levels 8 to 15 are 1,600, of 16 to 31
  // 100 a level.
  state.sample_seconds = 0.05;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), levels(20, false));
  // However slow, a level at a time.
  state.sample_seconds = 1e6;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), levels(9, false));
  // Carried samples are reviewed at the end of a round, not on the way.
  state.carried = true;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), levels(9, false));
  state.sample_seconds = 0;
  FramePlan reviewed = levels(64, true);
  reviewed.after = {StageId::review, StageId::measure};
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), reviewed);
}

// Means that the rounds of a picture aim at. All pixels get the same.
std::vector<double> course_of_rounds(double target, double sample_seconds, bool shown) {
  Budget budget;
  budget.error = target;
  const FrameScheduler scheduler(budget, {.passes = shown, .interval_s = 0.1}, pilot_of(16));
  FrameState state;
  state.round.pixels = 100;
  std::vector<double> means;
  double now = 0;
  std::uint64_t at_begin = 0;  // of the round
  for (int plans = 0; plans < 100000; ++plans) {
    state.sample_seconds = state.total() > 0 ? sample_seconds : 0;
    const FramePlan plan = scheduler.plan_next(state, now, 0, now);
    for (int h = 0; h < kHalves; ++h) state.done[h] = std::max(state.done[h], plan.target[h]);
    RoundState& round = state.round;
    if (plan.asks(StageId::allocate)) {
      means.push_back(plan.before[0].allocation.mean);
      ++round.number;
      round.mean = means.back();
      at_begin = round.samples;
      const auto top = std::uint32_t(std::ceil(round.mean));
      for (int h = 0; h < kHalves; ++h) {
        state.done[h] = std::min(state.done[h], top - 1);
        round.summary.top[h] = top;
        round.summary.by_octave[h] = {};
        round.summary.by_octave[h][std::size_t(std::bit_width(top - 1) - 1)] = 100;
      }
    } else if (round.number > 0) {
      // Some of the round's samples; all at its end.
      const double share = state.round_done() ? 1 : 0.5;
      round.samples = at_begin + std::uint64_t(share * (2 * 100 * round.mean - double(at_begin)));
    } else {
      round.samples = 100 * state.total();
    }
    now += 0.01;
    if (plan.asks(StageId::measure)) {
      state = with_error(state, uneven_error(state.total(), 0.5), 0);
      round.measured = round.samples;
    }
    if (plan.publish != Publish::none) {
      state.published = true;
      state.published_samples = state.total();
      round.published = round.samples;
      state.published_s = now;
    }
    if (plan.end) break;
  }
  means.push_back(double(state.round.samples));
  return means;
}

TEST(AdaptiveScheduler, TheRoundsOfAnErrorBudgetDoNotDependOnTime) {
  for (const double target : {0.1, 0.05, 0.021}) {
    const auto rounds = course_of_rounds(target, 0, false);
    EXPECT_GT(rounds.size(), 4u);
    for (const double sample_seconds : {1e-3, 0.03, 0.4, 100.0}) {
      for (const bool shown : {false, true}) {
        EXPECT_EQ(course_of_rounds(target, sample_seconds, shown), rounds) << target << " " << sample_seconds;
      }
    }
  }
}

TEST(AdaptiveScheduler, ADoneRoundIsFollowedByTheNextOrTheEnd) {
  FrameState state = in_round(64);
  state.round.samples = state.round.measured = state.round.published = 2 * 100 * 40;
  EXPECT_EQ(FrameScheduler({}, {.passes = false}, pilot_of(16)).plan_next(state, 0, 0, 0), allocate({.mean = 80}));
  Budget budget;
  budget.samples = 80;
  state.round.samples -= 1;  // rounded down, the mean is 79
  EXPECT_EQ(FrameScheduler(budget, {.passes = false}, pilot_of(16)).plan_next(state, 0, 0, 0),
            of_mean(finish(FrameEndReason::samples, true), 80));
}

TEST(AdaptiveScheduler, ThePaperVariantCountsIterations) {
  AllocationSettings paper = pilot_of(4);
  paper.iterates = true;
  const FrameScheduler scheduler({}, {.passes = false}, paper);
  EXPECT_EQ(scheduler.plan_next(at(2, 2), 0, 0, 0), allocate({.iteration = 4}));
  FrameState state = in_round(64);
  state.round.number = 3;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), allocate({.iteration = 7}));
}

TEST(AdaptiveScheduler, ThePaperVariantBeginsAtIterationNoughtWithWhatWasCarried) {
  AllocationSettings paper = pilot_of(4);
  paper.iterates = true;
  const FrameScheduler scheduler({}, {.passes = true}, paper);
  FrameState state = at(0, 0);
  state.reproject_due = true;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), carry()) << "pixels with a probability get no sample yet";
  // Nothing was carried: as without reuse.
  state.reproject_due = false;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), first_look());
  // Something was.
  state.fill = true;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), allocate({.iteration = 0, .fill = true}));
  // After the first iteration, which gave a tenth of the pixels a sample, there is something to show everywhere.
  state.round.number = 1;
  state.round.pixels = 100;
  state.round.samples = 10;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), of_mean(show(), 1));
  state.published = true;
  state.round.published = 10;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), allocate({.iteration = 1, .fill = true}));
}

TEST(AdaptiveScheduler, OnTopOfHistoryThereIsNoPilot) {
  Budget budget;
  budget.samples = 4;
  const FrameScheduler scheduler(budget, {.passes = true}, pilot_of(16));
  FrameState state = at(0, 0);
  state.reproject_due = true;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), carry()) << "what there is decides what comes with it";
  state.reproject_due = false;
  state.carried = true;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), first_look()) << "nearly nothing was carried";

  state.fill = true;
  state.round.pixels = 100;
  state.sample_seconds = 10;
  for (const double mean : {0.5, 1.0, 2.0}) {
    EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), allocate({.mean = mean, .fill = true}));
    state.round.number += 1;
    state.round.mean = mean;
    state.round.summary.top[0] = state.round.summary.top[1] = std::uint32_t(8 * mean);
    // The first round is one plan, however long it takes, and shows tile by tile.
    FramePlan round = levels(std::uint32_t(8 * mean), true);
    if (mean < 1) {
      round.publish = Publish::early;
      round.mean_samples = 1;
    }
    if (mean >= kHalfCheckedMean) round.after = {StageId::review, StageId::measure};
    EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), round);
    state.sample_seconds = 0;
    EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), round);
    state.done[0] = state.done[1] = state.round.summary.top[0];
    state.round.samples = std::uint64_t(200 * mean) - 1;
    state.round.measured = state.round.samples;
    // It may have given fewer samples than there are pixels, and shows what was carried with them.
    if (mean < 1) {
      EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), of_mean(show(), 1));
    }
    state.sample_seconds = 10;
    state.published = true;
    state.round.published = state.round.samples;
  }
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), of_mean(finish(FrameEndReason::samples), 4));
}

// Tile by tile, while others are still being reprojected: with their first samples where much is carried, else with
// the pilot's first.
TEST(AdaptiveScheduler, WhatIsCarriedIsShownTileByTile) {
  const FrameScheduler scheduler({}, {.passes = true}, pilot_of(16)), of_job({}, {.passes = false}, pilot_of(16));
  FrameState state = at(0, 0);
  state.reproject_due = state.transfer_prepared = true;
  FramePlan little = first_look();
  little.before = {StageId::reproject};
  little.by_tile = true;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), little);
  EXPECT_EQ(FrameScheduler({}, {}).plan_next(state, 0, 0, 0), little) << "where all pixels get equal counts";
  EXPECT_EQ(of_job.plan_next(state, 0, 0, 0), carry());
  state.fill = true;
  FramePlan much = of_mean(levels(1, false), 1);
  much.target[1] = 0;
  much.before = {StageId::reproject};
  much.before[0].first_samples = true;
  much.by_tile = true;
  EXPECT_EQ(of_job.plan_next(state, 0, 0, 0), much);
  much.publish = Publish::early;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), much);
  state.tiles_alone = false;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), carry()) << "no tile is ready before all are";

  // The round after it is the first that looks at errors.
  state = at(1, 0);
  state.fill = state.carried = true;
  state.round.number = state.round.first_samples = 1;
  state.round.samples = state.round.published = 5;
  state.round.pixels = 100;
  state.round.summary.top[0] = 1;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), allocate({.mean = 0.5, .fill = true}));
  state.round.number = 2;
  state.round.mean = 0.5;
  state.round.summary.top[0] = state.round.summary.top[1] = 4;
  FramePlan round = of_mean(levels(4, true), 1);
  round.publish = Publish::early;
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), round);
  // A target error is approached as if there had been no round before it.
  Budget error;
  error.error = 0.01;
  for (const std::uint32_t first : {0u, 1u}) {
    FrameState measured = with_error(at(16, 16), 0.02, 0);
    measured.round.number = 1 + first;
    measured.round.first_samples = first;
    measured.round.mean = 16;
    measured.round.samples = measured.round.measured = measured.round.published = 3200;
    measured.round.pixels = 100;
    measured.measured.samples = 32;
    measured.measured.error.hidden_rmse = 0;
    measured.fill = true;
    const FramePlan plan = FrameScheduler(error, {.passes = true}, pilot_of(16)).plan_next(measured, 0, 0, 0);
    EXPECT_EQ(plan, allocate({.mean = 16 * std::pow(4 * 1.02, 0.25), .fill = true}));
  }
}

TEST(AdaptiveScheduler, OneSampleOnTopOfHistoryIsOneRound) {
  Budget budget;
  budget.samples = 1;
  FrameState state = at(0, 0);
  state.sample_seconds = 1000;  // it is a plan of its own, however long it takes
  state.fill = true;
  state.round.pixels = 100;
  const FrameScheduler scheduler(budget, {.passes = false}, pilot_of(16));
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), allocate({.mean = 0.5, .fill = true}));
  state.round.number = 1;
  state.round.mean = 0.5;
  state.round.summary.top[0] = 3;
  state.round.summary.by_octave[0][0] = state.round.summary.by_octave[0][1] = 50;
  FramePlan shown = of_mean(levels(3, true), 1);
  shown.publish = Publish::early;
  shown.final = true;
  EXPECT_EQ(FrameScheduler(budget, {.passes = true}, pilot_of(16)).plan_next(state, 0, 0, 0), shown);
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), levels(1, false)) << "of a job";
  state.round.summary.top[0] = 0;
  state.round.samples = 99;
  EXPECT_EQ(scheduler.budget_used(state, 0), 1);
  EXPECT_EQ(scheduler.plan_next(state, 0, 0, 0), of_mean(finish(FrameEndReason::samples), 1));
}

}  // namespace
}  // namespace helio
