// Decides what a frame does next. Pure: touches no pixel and no clock, so that it is tested by comparing plans.
//
// The course of a frame: one sample of half A everywhere, each tile shown as soon as it is done (where light paths land
// on any tile: all of them once the last is); one of half B; then A and B to the same power of two, doubling. A plan is
// cut short of its power of two where it would outlast the publication interval, the time budget, or the count at which
// the target error is expected.
//
// Mode adaptive: the pilot follows the course above, up to min_samples. After it come rounds. The first plan of a round
// computes the counts (stage `allocate`); its other plans integrate them level by level. The mean count doubles from
// round to round, or grows by less near the end of a budget. Where much was carried over there is no pilot: a first
// round gives pixels that carry nothing one sample, tile by tile while the rest is still being reprojected; the next
// has as many samples as there are pixels. Tiles of both are shown one by one. Of a rule that iterates
// (AllocationSettings::iterates) a round is an iteration, the pilot being the first ones; where anything was carried
// over they begin at 0.
//
// Where a gaze decides the counts, a move of it ends the round in hand: the next has no more samples, elsewhere.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "renderer/film/allocation/sample_allocation.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/film/estimate/resolve.h"
#include "renderer/frame/frame_plan.h"
#include "renderer/frame/render_settings.h"

namespace helio {

// Samples per pixel, both halves, at which an unlimited frame ends.
inline constexpr std::uint32_t kMaxSamplesPerPixel = 1u << 30;
// A target error is not believed before this many samples per pixel.
inline constexpr std::uint32_t kMinSamplesForError = 16;

// An error estimate and the samples per pixel (both halves) it was made at.
struct ErrorAtCount {
  std::uint32_t samples = 0;
  FilmError error;
};

// A round of mode adaptive (film/core/sample_targets.h).
struct RoundState {
  std::uint32_t number = 0;  // 0: all pixels have the same count; none yet, or the pilot's
  // Of these, rounds that did not look at errors: 1 where the first was of film/allocation/first_samples.h.
  std::uint32_t first_samples = 0;
  double mean = 0;           // per half, that the round was asked for; 0: of a rule that iterates
  RoundSummary summary;
  std::uint64_t samples = 0;                  // pixel samples of the film, both halves
  std::uint64_t measured = 0, published = 0;  // `samples` at the newest estimate | publication
  std::uint64_t pixels = 0;                   // of the region
  std::uint64_t gaze_moves = 0;               // FrameState::gaze_moves when its counts were decided
};

// State of a frame, as the scheduler needs it. Times in seconds of wall time, points in time on the now_s() clock.
struct FrameState {
  std::uint64_t revision = 0;
  double begun_s = 0;
  // Samples that every pixel of the region has; in a round: levels that are done.
  std::uint32_t done[kHalves] = {0, 0};
  RoundState round;
  bool reproject_due = false;  // before the first sample, earlier pictures are to be reprojected
  bool transfer_prepared = false;  // while that is so: what they know is known (`fill`), nothing of it is in the film
  bool choice_due = false;     // before the first sample, the tiles that get light paths are to be chosen
  // A tile's pixels are done once its own samples are in; false: light paths of all the others land there too.
  bool tiles_alone = true;
  bool carried = false;        // the picture has reprojected samples, which stage `review` is to test
  // So many pixels have history that FillAllocation is used; false: NeymanAllocation, as without history.
  bool fill = false;
  // Where counts follow a gaze (density_share < 1): its moves so far, and the mean of the density over the pixels, in
  // which every one has at least what a pilot gives it, (0, 1]. Budgets of samples mean pixels of density 1.
  std::uint64_t gaze_moves = 0;
  double density_share = 1;
  ErrorAtCount measured;  // the newest estimate; samples == 0: none

  bool published = false;               // something of this frame was shown
  bool published_final = false;         // everything was, as final
  std::uint32_t published_samples = 0;  // at the last publication
  double published_s = 0;               // when that was
  bool republish = false;               // someone asked for the newest state
  bool checkpoint_due = false;          // a copy of the picture is to be kept
  bool checkpoint_asked = false;        // and somebody waits for it, even where the budget is reached
  bool restore_due = false;             // before all else, the picture is to be taken from such a copy
  bool display_due = false;             // what is published next is to be filtered for the eye first
  std::uint64_t displayed = 0;          // pixel samples of the film at the newest display layer; 0: there is none

  std::size_t tiles = 1;
  double sample_seconds = 0;   // for as many samples as the region has pixels; 0: not known yet
  double measure_seconds = 0;  // for one error estimate
  double display_seconds = 0;  // for one display layer
  double publish_seconds = 0;  // for one publication of every tile
  double publish_bytes = 0;    // of one publication of every tile

  // Samples per pixel, both halves: of every pixel; in a round: the mean, rounded down.
  std::uint32_t total() const {
    return round.number == 0 ? done[0] + done[1]
                             : std::uint32_t(round.samples / std::max<std::uint64_t>(round.pixels, 1));
  }
  // The same as it is told: of a round the mean, rounded, and not nothing where there are samples.
  std::uint32_t told() const {
    if (round.number == 0 || round.samples == 0 || round.pixels == 0) return total();
    return std::max(1u, std::uint32_t((round.samples + round.pixels / 2) / round.pixels));
  }
  // Whether the newest estimate is of all samples that there are.
  bool measured_now() const {
    return round.number == 0 ? measured.samples == total() : round.measured == round.samples;
  }
  // The round in hand is of another gaze.
  bool gaze_moved() const { return round.number > 0 && round.gaze_moves != gaze_moves; }
  bool round_done() const { return done[0] >= round.summary.top[0] && done[1] >= round.summary.top[1]; }
};

struct PublishPolicy {
  bool passes = true;  // false: only the final state (jobs)
  // Between publications that are not at powers of two; grows with the age of the view. Filtering for the eye makes it
  // longer, at powers of two as well.
  double interval_s = 0.25;
};

class FrameScheduler {
 public:
  // allocation: mode adaptive; absent: every pixel gets the same number of samples.
  FrameScheduler(const Budget& budget, const PublishPolicy& policy,
                 const std::optional<AllocationSettings>& allocation = std::nullopt)
      : budget_(budget), policy_(policy), allocation_(allocation) {}

  void set_rate(std::optional<double> bytes_per_second) { budget_.bytes_per_second = bytes_per_second; }

  // view_age_s: since the view was accepted. backlog: tiles waiting behind the sink.
  FramePlan plan_next(const FrameState& state, double view_age_s, std::size_t backlog, double now_s) const;

  // Share of the budget that is used, [0, 1]; 0 when unlimited.
  double budget_used(const FrameState& state, double now_s) const;

 private:
  std::optional<FrameEndReason> reached(const FrameState& state, double now_s) const;
  bool publication_due(const FrameState& state, double view_age_s, std::size_t backlog, double now_s) const;
  FramePlan plan_integration(const FrameState& state, double view_age_s, double now_s) const;
  bool pilot_done(const FrameState& state) const;
  FramePlan plan_allocation(const FrameState& state, double now_s) const;
  FramePlan plan_round(const FrameState& state, double view_age_s, double now_s) const;
  std::uint32_t next_iteration(const FrameState& state) const;
  double longest_plan_s(const FrameState& state, double view_age_s) const;
  std::uint32_t sample_limit() const;
  double mean_limit(const FrameState& state) const;
  double deadline_s(const FrameState& state) const;
  double interval_s(double view_age_s) const;
  bool error_usable(const ErrorAtCount& measured) const;
  double variance_over_target(const FilmError& error) const;

  Budget budget_;
  PublishPolicy policy_;
  std::optional<AllocationSettings> allocation_;
};

}  // namespace helio
