// One step of a frame, as a value: what the scheduler decided and the pipeline obeys.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "renderer/film/allocation/sample_allocation.h"
#include "renderer/film/core/film.h"
#include "renderer/frame/frame_sink.h"

namespace helio {

enum class Publish {
  none,
  early,  // each tile as soon as its own pixels have reached the target
  round,  // every tile, once the plan's samples are in
};

struct FramePlan {
  std::uint64_t revision = 0;

  // reproject: the film becomes a source of history and is filled for the new camera (stages/temporal_reprojection.h).
  bool reproject = false;

  // centres: what the pixels of the picture in hand show at their centres is found out (stages/centre_search.h); of
  // such a plan nothing else is asked.
  bool centres = false;

  // choose: which tiles get light paths (stages/choose_integrators.h).
  bool choose = false;
  double choose_until_s = std::numeric_limits<double>::infinity();  // later nothing more is probed

  // allocate: how many samples each pixel gets in the round that begins with this plan.
  std::optional<AllocationRequest> allocate;

  // integrate: every pixel of the region gets samples until it has this many of each half; in a round, until it has
  // this many or what the round wants for it. A half that already has as many is left alone, so {0, 0} integrates
  // nothing.
  std::uint32_t target[kHalves] = {0, 0};
  bool round = false;  // counts differ from pixel to pixel
  // No piece of the integration starts later (now_s() clock); the rest of the plan is then dropped.
  double deadline_s = std::numeric_limits<double>::infinity();

  std::uint32_t mean_samples = 0;  // in a round: what the picture has per pixel, both halves (FrameState::told())

  bool review = false;   // take back history that the samples contradict (stages/reject_history.h)
  bool measure = false;  // estimate the picture's error afterwards
  Publish publish = Publish::none;
  bool final = false;  // what is published is the last of the frame; pixels without samples are shown empty

  std::optional<FrameEndReason> end;  // the frame ends with this plan

  bool operator==(const FramePlan&) const = default;
};

}  // namespace helio
