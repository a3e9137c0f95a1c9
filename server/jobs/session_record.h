// What is written down of a session, beside the samples of its picture, so that another daemon can make it again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "renderer/base/result.h"
#include "renderer/frame/render_settings.h"

namespace helio {

struct SessionRecord {
  std::string scene_id;
  std::string owner;          // name of the token that it belongs to; empty: the daemon had none
  RenderSettings settings;
  Budget budget;
  double grace_s = 0;         // > 0
  double kept_s = 0;          // Unix time
  std::optional<View> view;   // to the bit
  std::string build;          // rendering_build() of the samples
  std::string without;        // why no samples are kept; empty: they are, or there were none

  std::string write() const;  // a sealed message of session_record.proto
  // internal: no record, one of a version that this program does not know, or with values out of their ranges.
  static Result<SessionRecord> read(const std::string& bytes, const RenderLimits& limits);
};

}  // namespace helio
