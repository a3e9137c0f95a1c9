#include "renderer/frame/frame_scheduler.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace helio {

namespace {

// Publications are at least this share of the view's age apart: a long render is shown O(log) times.
constexpr double kIntervalPerAge = 1.0 / 16;
// Even a plan that is not to be published is kept this short, so that a republish or new budget need not wait.
constexpr double kLongestPlanSeconds = 1.0;
// The same where a gaze decides where samples go, and may move.
constexpr double kLongestGazePlanSeconds = 0.1;
// The variance of Sobol points falls as 1/n (noise) to 1/n^3 (edges, towards a power of two). The next look at the
// error is where the fastest decay would have it in reach, and at least this share of the samples of the last look
// away: a look costs less than a sample, but a step too far overshoots. It follows from the last look alone, not from
// how far plans have come since, which is a matter of time: a picture ends with the same samples on every machine.
constexpr double kFastestDecay = 3.0;
constexpr double kSmallestErrorStep = 1.0 / 32;
// A round that is to reach a target error aims this much beyond it: the variance falls about as 1/n, n: mean count.
constexpr double kRoundMargin = 1.02;
// Of the first rounds n^-8, n^-4 and n^-2: all that is beyond the even counts of the pilot goes to the few noisy pixels.
constexpr double kFirstRoundDecay = 8;

// Of the time since a publication, what filtering the next for the eye may take. The first and the last of a frame are
// filtered whatever it takes.
constexpr double kDisplayShare = 0.1;
// Of a time budget, what choosing between techniques may take.
constexpr double kChoiceShare = 0.25;

std::uint32_t next_power_of_two(std::uint32_t n) {
  return n == 0 ? 1 : std::bit_ceil(n + 1);
}

}  // namespace

std::uint32_t FrameScheduler::sample_limit() const {
  return std::min(budget_.samples.value_or(kMaxSamplesPerPixel), kMaxSamplesPerPixel);
}

// Of the mean over the pixels, both halves.
double FrameScheduler::mean_limit(const FrameState& state) const {
  return std::max(double(sample_limit()) * state.density_share, 1.0);
}

// Measuring and showing the result belong to the time asked for, unless they would eat more than half of it.
double FrameScheduler::deadline_s(const FrameState& state) const {
  if (!budget_.time_s) return std::numeric_limits<double>::infinity();
  const double reserve =
      std::min(state.measure_seconds + state.display_seconds + state.publish_seconds, *budget_.time_s / 2);
  return state.begun_s + *budget_.time_s - reserve;
}

double FrameScheduler::interval_s(double view_age_s) const {
  return std::max(policy_.interval_s, view_age_s * kIntervalPerAge);
}

bool FrameScheduler::error_usable(const ErrorAtCount& measured) const {
  return budget_.error && measured.samples >= kMinSamplesForError && measured.error.known &&
         std::isfinite(measured.error.hidden_rmse);
}

double FrameScheduler::variance_over_target(const FilmError& error) const {
  const double target = *budget_.error;
  const double seen = error.rmse / target, hidden = error.hidden_rmse / target;
  return seen * seen + hidden * hidden;
}

std::optional<FrameEndReason> FrameScheduler::reached(const FrameState& state, double now_s) const {
  if (error_usable(state.measured) && state.measured_now() && variance_over_target(state.measured.error) <= 1)
    return FrameEndReason::error;
  if (state.total() >= sample_limit()) return FrameEndReason::samples;
  if (state.round.number > 0 && !state.gaze_moved() && state.round_done() &&
      kHalves * state.round.mean >= mean_limit(state))
    return FrameEndReason::samples;  // the mean is rounded down
  // What earlier pictures know is carried over even then: there is nothing else to show.
  if (!state.reproject_due && now_s >= deadline_s(state)) return FrameEndReason::time;
  return std::nullopt;
}

bool FrameScheduler::publication_due(const FrameState& state, double view_age_s, std::size_t backlog,
                                     double now_s) const {
  // After one round on top of history every pixel has something, though fewer than one fresh sample on average.
  const bool shows_carried = allocation_ && state.fill && state.round.number > 0 && state.round_done();
  if (state.total() == 0 && !shows_carried) return false;
  if (state.republish) return true;
  if (!policy_.passes) return false;
  if (!state.published) return true;
  if (state.round.number > 0 ? state.round.published == state.round.samples : state.total() == state.published_samples)
    return false;

  const double since = now_s - state.published_s;
  if (budget_.bytes_per_second && since < state.publish_bytes / *budget_.bytes_per_second) return false;
  if (backlog >= state.tiles) return false;  // a whole picture waits already: the newest state comes after it
  const double display = state.display_due && state.displayed > 0 ? state.display_seconds / kDisplayShare : 0;
  if (std::has_single_bit(state.told()) && backlog == 0) return since >= display;
  const double waiting_pictures = double(backlog) / double(std::max<std::size_t>(state.tiles, 1));
  return since >= std::max(interval_s(view_age_s), display) * (1 + 3 * waiting_pictures);
}

double FrameScheduler::longest_plan_s(const FrameState& state, double view_age_s) const {
  if (state.density_share < 1) return kLongestGazePlanSeconds;
  return policy_.passes ? std::min(interval_s(view_age_s), kLongestPlanSeconds) : kLongestPlanSeconds;
}

// What was carried over is one, if it is much.
bool FrameScheduler::pilot_done(const FrameState& state) const {
  return allocation_ && !state.reproject_due &&
         (state.fill || state.round.number > 0 ||
          std::min(state.done[0], state.done[1]) >= allocation_->min_samples / 2);
}

// Where rounds are iterations: the number of the one that comes next, or is in hand.
std::uint32_t FrameScheduler::next_iteration(const FrameState& state) const {
  return (state.fill ? 0 : allocation_->min_samples) + state.round.number;
}

// The next round: the mean count that it aims at, per half.
FramePlan FrameScheduler::plan_allocation(const FrameState& state, double now_s) const {
  FramePlan plan;
  plan.revision = state.revision;
  plan.round = true;
  StageRequest& allocate = plan.before.emplace_back(StageId::allocate);
  allocate.allocation.fill = state.fill;
  if (allocation_->iterates) {
    allocate.allocation.iteration = next_iteration(state);
    return plan;
  }
  // Of a few pixels the counts, powers of two, may stay below what was asked for: what is asked for grows all the same.
  const double has = state.round.number > 0 ? double(state.round.samples) / double(kHalves * state.round.pixels)
                                            : 0.5 * double(state.total());
  const double limit = mean_limit(state) / kHalves;
  // What was taken elsewhere before the gaze moved is no part of what is asked for here.
  const bool follows_gaze = state.density_share < 1;
  const double mean = !follows_gaze                                    ? std::max(has, state.round.mean)
                      : state.gaze_moved() || state.round.number == 0 ? std::min(has, limit)
                                                                       : state.round.mean;
  // The first one on top of history: as many samples as there are pixels, where they are needed.
  double goal = 1.0 / kHalves;
  if (mean > 0) {
    double growth = 2;
    if (error_usable(state.measured) && state.measured_now()) {
      const std::uint32_t before = std::min(state.round.number - state.round.first_samples, 8u);
      const double decay = std::max(1.0, std::ldexp(kFirstRoundDecay, -int(before)));
      const double wanted = std::pow(variance_over_target(state.measured.error) * kRoundMargin, 1 / decay);
      growth = std::clamp(wanted, 1 + kSmallestErrorStep, growth);
    }
    goal = std::max(goal, mean * growth);
  }
  goal = std::min(goal, limit);
  if (budget_.time_s && state.sample_seconds > 0) {
    const double left = std::max(0.0, deadline_s(state) - now_s);
    goal = std::min(goal, mean + std::max(left / (kHalves * state.sample_seconds), mean * kSmallestErrorStep));
  }
  allocate.allocation.mean = std::max(goal, mean);
  return plan;
}

// Levels of the round, up to where the plan has lasted long enough.
FramePlan FrameScheduler::plan_round(const FrameState& state, double view_age_s, double now_s) const {
  FramePlan plan;
  plan.revision = state.revision;
  plan.round = true;
  plan.deadline_s = deadline_s(state);
  const RoundSummary& round = state.round.summary;
  const std::uint32_t top = std::max(round.top[0], round.top[1]);
  // The first that looks at errors is shown tile by tile, however long it takes.
  const bool first_look = state.fill && !allocation_->iterates && policy_.passes && state.tiles_alone &&
                          state.round.number == 1 + state.round.first_samples &&
                          state.round.samples == state.round.published;
  std::uint32_t level = top;
  for (int h = 0; h < kHalves; ++h) {
    if (state.done[h] < round.top[h]) level = std::min(level, state.done[h]);
  }
  if (state.sample_seconds > 0 && !first_look) {
    const double left = std::clamp(plan.deadline_s - now_s, 0.0, longest_plan_s(state, view_age_s));
    double samples = left / state.sample_seconds * double(state.round.pixels);  // that can be had
    const std::uint32_t first = level;
    while (level < top) {
      const int octave = level == 0 ? 0 : std::bit_width(level) - 1;
      const std::uint32_t begin = octave == 0 ? 0 : 1u << octave;
      const auto end = std::uint32_t(std::min<std::uint64_t>(top, std::uint64_t(2) << octave));
      const double per_level =
          double(round.by_octave[0][std::size_t(octave)] + round.by_octave[1][std::size_t(octave)]) /
          double((std::uint64_t(2) << octave) - begin);
      const double affordable = std::floor(samples / std::max(per_level, 1e-9));
      if (affordable < double(end - level)) {
        level += std::uint32_t(affordable);
        break;
      }
      samples -= per_level * double(end - level);
      level = end;
    }
    level = std::max(level, std::min(first + 1, top));
  } else {
    level = top;
  }
  for (int h = 0; h < kHalves; ++h) plan.target[h] = level;
  const bool ends_round = level >= top;
  if (first_look) {
    plan.publish = Publish::early;
    plan.final = sample_limit() == 1;
    plan.mean_samples = std::max(1u, std::uint32_t(kHalves * state.round.mean + 0.5));
  }
  const std::uint32_t iteration = next_iteration(state);
  // Of fewer pixels a single bright sample would be taken for what history lacks.
  const bool review = state.carried && (!state.fill || state.round.mean >= kHalfCheckedMean);
  const bool measure = !allocation_->iterates || budget_.error || std::has_single_bit(iteration);
  if (ends_round && review) plan.after.push_back(StageId::review);
  if (ends_round && measure) plan.after.push_back(StageId::measure);
  return plan;
}

FramePlan FrameScheduler::plan_integration(const FrameState& state, double view_age_s, double now_s) const {
  if (pilot_done(state)) {
    const bool next_round = state.round.number == 0 || state.round_done() || state.gaze_moved();
    return next_round ? plan_allocation(state, now_s) : plan_round(state, view_age_s, now_s);
  }
  const std::uint32_t limit = allocation_ ? std::min(sample_limit(), allocation_->min_samples) : sample_limit();
  const std::uint32_t limit_of[kHalves] = {limit - limit / 2, limit / 2};
  FramePlan plan;
  plan.revision = state.revision;
  plan.deadline_s = deadline_s(state);
  if (state.reproject_due) {
    plan.before.push_back(StageId::reproject);
    // What there is to be carried decides what comes with it.
    if (!state.transfer_prepared && !(allocation_ && allocation_->iterates)) return plan;
  }
  if (state.choice_due) {
    // What is chosen decides whether tiles can be shown one by one.
    StageRequest& choose = plan.before.emplace_back(StageId::choose);
    if (budget_.time_s) choose.until_s = state.begun_s + kChoiceShare * *budget_.time_s;
    return plan;
  }
  if (state.reproject_due) {
    // What it finds decides what comes next.
    if (allocation_ && (allocation_->iterates || !state.tiles_alone)) return plan;
    if (allocation_ && state.fill) {
      // Where counts fill up what is missing, most pixels get nothing at first.
      plan.before.back().first_samples = true;
      plan.round = plan.by_tile = true;
      plan.target[0] = 1;
      plan.mean_samples = 1;
      if (policy_.passes) plan.publish = Publish::early;
      return plan;
    }
    if (!policy_.passes) return plan;
    plan.target[0] = 1;
    plan.by_tile = state.tiles_alone;
    plan.publish = state.tiles_alone ? Publish::early : Publish::round;
    plan.final = sample_limit() == 1;
    return plan;
  }

  if (state.done[0] == 0 && policy_.passes) {
    plan.target[0] = 1;
    plan.publish = state.tiles_alone ? Publish::early : Publish::round;
    plan.final = sample_limit() == 1;
    return plan;
  }

  const std::uint32_t pairs = std::min(state.done[0], state.done[1]);
  std::uint32_t goal = next_power_of_two(pairs);
  if (state.done[1] < state.done[0]) {
    goal = state.done[0];
  } else if (state.sample_seconds > 0) {
    const double pair_seconds = state.sample_seconds * kHalves;
    const double longest = std::min(longest_plan_s(state, view_age_s), plan.deadline_s - now_s);
    const double affordable = std::max(1.0, std::floor(longest / pair_seconds));
    goal = std::uint32_t(std::min<double>(goal, double(pairs) + affordable));
  }

  std::uint32_t goal_of[kHalves] = {goal, goal};
  bool error_expected = false;
  if (error_usable(state.measured) && pairs > 0) {
    const double n = state.measured.samples;
    const double wanted = n * std::pow(variance_over_target(state.measured.error), 1 / kFastestDecay);
    const double smallest = n + std::max(1.0, std::floor(n * kSmallestErrorStep));
    const double expected = std::max(std::ceil(wanted), smallest);
    if (expected <= 2.0 * goal) {
      // Single samples count: between 30 and 32 of Sobol's points the error may fall by a quarter.
      const auto samples = std::uint32_t(expected);
      goal_of[0] = samples - samples / 2;
      goal_of[1] = samples / 2;
      error_expected = true;
    }
  }

  for (int h = 0; h < kHalves; ++h) plan.target[h] = std::max(state.done[h], std::min(goal_of[h], limit_of[h]));
  const std::uint32_t total = plan.target[0] + plan.target[1];
  const bool look = std::has_single_bit(total) || total >= limit;
  if (state.carried && plan.target[1] > 0 && look) plan.after.push_back(StageId::review);
  if (plan.target[1] > 0 && (error_expected || look)) plan.after.push_back(StageId::measure);
  return plan;
}

FramePlan FrameScheduler::plan_next(const FrameState& state, double view_age_s, std::size_t backlog,
                                    double now_s) const {
  FramePlan plan;
  plan.revision = state.revision;
  if (state.restore_due) {
    plan.before.push_back(StageId::restore);
    return plan;
  }
  if (state.checkpoint_due && state.checkpoint_asked) {
    plan.before.push_back(StageId::checkpoint);
    return plan;
  }
  plan.mean_samples = state.round.number > 0 ? state.told() : 0;
  if (const auto reason = reached(state, now_s)) {
    if (!state.measured_now() && state.done[0] > 0 && state.done[1] > 0) plan.after.push_back(StageId::measure);
    plan.publish = state.published_final ? Publish::none : Publish::round;
    if (state.display_due && plan.publish != Publish::none) plan.after.push_back(StageId::display);
    plan.final = true;
    plan.end = reason;
    return plan;
  }
  if (state.checkpoint_due) {
    plan.before.push_back(StageId::checkpoint);
    return plan;
  }
  if (publication_due(state, view_age_s, backlog, now_s)) {
    if (state.display_due) plan.after.push_back(StageId::display);
    plan.publish = Publish::round;
    return plan;
  }
  return plan_integration(state, view_age_s, now_s);
}

double FrameScheduler::budget_used(const FrameState& state, double now_s) const {
  double used = 0;
  if (budget_.samples) used = std::max(used, double(state.told()) / mean_limit(state));
  if (budget_.time_s) used = std::max(used, (now_s - state.begun_s) / *budget_.time_s);
  // Variance falls about as 1/n, so the share of the samples that are needed is target variance over variance.
  if (error_usable(state.measured))
    used = std::max(used, 1 / std::max(1.0, variance_over_target(state.measured.error)));
  return std::clamp(used, 0.0, 1.0);
}

}  // namespace helio
