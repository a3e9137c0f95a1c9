// RenderSettings and Budget <-> their messages. What is allowed is told by the validator (renderer/frame/
// render_settings.h); here are the meaning of zero, unknown numbers of enumerations, and fields that no longer offer a
// choice.
#pragma once

#include <string>

#include "heliograph/v1/types.pb.h"
#include "renderer/base/result.h"
#include "renderer/frame/render_settings.h"

namespace helio {

namespace pb = heliograph::v1;

// Adds every problem, with the field's path behind `where`. The film's pixels are left to check_film_size().
RenderSettings read_settings(const pb::RenderSettings& message, const RenderLimits& limits, const std::string& where,
                             Problems& problems);
// resource_exhausted, naming max_film_pixels, for a film that is too large. Call it with settings without problems.
Status check_film_size(const RenderSettings& settings, const RenderLimits& limits, const std::string& where);
Budget read_budget(const pb::Budget& message, const std::string& where, Problems& problems);

// Parts of settings, as replay tokens have them too; whoever reads them validates the whole.
// `scale`: 0 stands for the filter's default. `where` is that of the message that holds filter and filter_scale.
PixelFilter read_filter(pb::PixelFilter kind, double scale, const std::string& where, Problems& problems);
// Defaults where the integrator does without.
LightCacheSettings read_light_cache(const pb::LightCacheSettings& message, Integrator integrator,
                                    const std::string& where, Problems& problems);
Integrator read_integrator(pb::Integrator integrator, const std::string& where, Problems& problems);
Technique read_technique(const pb::Technique& message, const std::string& where, Problems& problems);
RouletteRule read_roulette(pb::RouletteRule rule, const std::string& where, Problems& problems);

pb::Mode to_message(RenderMode mode);
pb::Integrator to_message(Integrator integrator);
pb::PixelFilter to_message(PixelFilterKind kind);
pb::RouletteRule to_message(RouletteRule rule);
pb::LightCacheSettings to_message(const LightCacheSettings& cache);
pb::Technique to_message(const Technique& technique);
pb::RenderSettings to_message(const RenderSettings& settings);
pb::Budget to_message(const Budget& budget);
void write_rect(const PixelRect& rect, pb::Rect& message);

}  // namespace helio
