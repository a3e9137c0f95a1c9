// One step of a frame, as a value: what the scheduler decided and the pipeline obeys.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "renderer/film/core/film.h"
#include "renderer/frame/frame_sink.h"
#include "renderer/frame/stage.h"

namespace helio {

enum class Publish {
  none,
  early,  // each tile as soon as its own pixels have reached the target
  round,  // the whole picture, once the plan's samples are in
};

// In this order: the stages of `before`, samples, the stages of `after`, publication.
struct FramePlan {
  std::uint64_t revision = 0;

  std::vector<StageRequest> before;

  // Every pixel of the region gets samples until it has this many of each half; in a round, until it has this many or
  // what the round wants for it. A half that already has as many is left alone, so {0, 0} integrates nothing.
  std::uint32_t target[kHalves] = {0, 0};
  bool round = false;  // counts differ from pixel to pixel
  // Samples and publication follow the one stage of `before`, whose parts have an order, tile by tile: tiles get them
  // as soon as the stage is done with them. In a round, as the stage has set the targets.
  bool by_tile = false;
  // No piece of the integration starts later (now_s() clock); the rest of the plan is then dropped.
  double deadline_s = std::numeric_limits<double>::infinity();

  // In a round: samples per pixel, both halves, that are reported with the tiles: FrameState::told(), or, where the
  // round's tiles are shown one by one, the mean that the round aims at.
  std::uint32_t mean_samples = 0;

  std::vector<StageRequest> after;
  Publish publish = Publish::none;
  bool final = false;  // what is published is the last of the frame; pixels without samples are shown empty

  std::optional<FrameEndReason> end;  // the frame ends with this plan

  bool asks(StageId id) const {
    const auto is = [id](const StageRequest& request) { return request.id == id; };
    return std::any_of(before.begin(), before.end(), is) || std::any_of(after.begin(), after.end(), is);
  }
  bool operator==(const FramePlan&) const = default;
};

}  // namespace helio
