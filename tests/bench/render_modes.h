// The modes that benches compare: the one list to which later modes are added.
#pragma once

#include "renderer/frame/render_settings.h"

namespace helio::bench {

inline constexpr const auto& kRenderModes = kEveryRenderMode;

}  // namespace helio::bench
