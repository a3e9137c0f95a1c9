#include "server/stream/settings_messages.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "server/base/read_enum.h"

namespace helio {
namespace {

constexpr std::pair<RenderMode, pb::Mode> kModes[] = {{RenderMode::pt, pb::MODE_PT},
                                                      {RenderMode::adaptive, pb::MODE_ADAPTIVE},
                                                      {RenderMode::reproject, pb::MODE_REPROJECT},
                                                      {RenderMode::combined, pb::MODE_COMBINED}};
static_assert(std::size(kModes) == std::size(kEveryRenderMode));

constexpr std::pair<Integrator, pb::Integrator> kIntegrators[] = {
    {Integrator::path, pb::INTEGRATOR_PATH},    {Integrator::light, pb::INTEGRATOR_LIGHT},
    {Integrator::bdpt, pb::INTEGRATOR_BDPT},    {Integrator::pt_bdpt, pb::INTEGRATOR_PT_BDPT},
    {Integrator::lvc, pb::INTEGRATOR_LVC},      {Integrator::vcm, pb::INTEGRATOR_VCM},
    {Integrator::photon, pb::INTEGRATOR_PHOTON}};
static_assert(std::size(kIntegrators) == std::size(kEveryIntegrator));

constexpr std::pair<PixelFilterKind, pb::PixelFilter> kFilters[] = {
    {PixelFilterKind::box, pb::PIXEL_FILTER_BOX},
    {PixelFilterKind::tent, pb::PIXEL_FILTER_TENT},
    {PixelFilterKind::gaussian, pb::PIXEL_FILTER_GAUSSIAN}};

constexpr std::pair<Foveation, pb::Foveation> kFoveations[] = {{Foveation::none, pb::FOVEATION_NONE},
                                                               {Foveation::density, pb::FOVEATION_DENSITY},
                                                               {Foveation::paper, pb::FOVEATION_PAPER}};

template <class Value, class Message, std::size_t n>
Value value_of(const std::pair<Value, Message> (&pairs)[n], Message message) {
  for (const auto& [value, number] : pairs) {
    if (number == message) return value;
  }
  return pairs[0].first;
}
template <class Value, class Message, std::size_t n>
Message message_of(const std::pair<Value, Message> (&pairs)[n], Value value) {
  for (const auto& [known, number] : pairs) {
    if (known == value) return number;
  }
  return Message();
}

// No int holds all of uint32: what is beyond is refused by its range.
int saturated(std::uint32_t value) {
  return int(std::min<std::uint32_t>(value, std::numeric_limits<int>::max()));
}

AdaptiveSettings read_adaptive(const pb::AdaptiveSettings& message, ModeVariant variant, const std::string& where,
                               Problems& problems) {
  AdaptiveSettings adaptive;
  if (variant == ModeVariant::paper) adaptive.min_samples = kPaperMinSamples;
  if (message.min_samples() != 0) adaptive.min_samples = message.min_samples();
  if (message.max_samples() != 0) adaptive.max_samples = message.max_samples();
  const pb::ErrorMeasure measure = read_enum(*pb::ErrorMeasure_descriptor(), message.measure(),
                                             pb::ERROR_MEASURE_RELMSE, field_path(where, "measure"), problems);
  adaptive.measure = measure == pb::ERROR_MEASURE_RMSE ? ErrorMeasure::rmse : ErrorMeasure::relmse;
  return adaptive;
}

ReprojectionSettings read_reprojection(const pb::ReprojectionSettings& message, ModeVariant variant,
                                       const std::string& where, Problems& problems) {
  ReprojectionSettings reprojection;
  check_constant_enum(*pb::ReprojectionMapping_descriptor(), message.mapping(), pb::REPROJECTION_MAPPING_REVERSE,
                      field_path(where, "mapping"), problems);
  if (variant != ModeVariant::paper) return reprojection;
  if (message.stored_hits() != 0) reprojection.stored_hits = saturated(message.stored_hits());
  if (message.max_error() != 0) reprojection.max_error = message.max_error();
  return reprojection;
}

PublishedFoveation read_published_foveation(const pb::FoveationPaperSettings& message) {
  PublishedFoveation published;
  if (message.disk() != 0) published.disk = message.disk();
  published.antialiasing = !message.without_antialiasing();
  published.reject_history = message.reject_history();
  published.fixed_disk = message.fixed_disk();
  published.mean_rate = message.mean_rate();
  published.surface_motion = message.surface_motion();
  return published;
}

void write_published_foveation(const PublishedFoveation& published, pb::FoveationPaperSettings& message) {
  message.set_disk(published.disk);
  message.set_without_antialiasing(!published.antialiasing);
  message.set_reject_history(published.reject_history);
  message.set_fixed_disk(published.fixed_disk);
  message.set_mean_rate(published.mean_rate);
  message.set_surface_motion(published.surface_motion);
}

}  // namespace

LightCacheSettings read_light_cache(const pb::LightCacheSettings& message, Integrator integrator,
                                    const std::string& where, Problems& problems) {
  LightCacheSettings cache;
  if (message.shrinking() != 0 && message.shrinking() != cache.shrinking)
    add_constant_problem(number_text(message.shrinking()), number_text(cache.shrinking) + ", or 0",
                         field_path(where, "shrinking"), problems);
  if (!caches_light_vertices(integrator)) return cache;
  if (message.connections() != 0 && integrator != Integrator::photon)
    cache.connections = saturated(message.connections());
  if (message.radius() != 0 && merges(integrator)) cache.radius = message.radius();
  return cache;
}

PixelFilter read_filter(pb::PixelFilter kind, double scale, const std::string& where, Problems& problems) {
  PixelFilter filter;
  filter.kind = value_of(kFilters, read_enum(*pb::PixelFilter_descriptor(), kind, pb::PIXEL_FILTER_BOX,
                                             field_path(where, "filter"), problems));
  filter.scale = scale != 0 ? scale : default_pixel_filter_scale(filter.kind);
  const bool box = kind == pb::PIXEL_FILTER_UNSPECIFIED || kind == pb::PIXEL_FILTER_BOX;
  if (box && scale != 0)
    problems.add(field_path(where, "filter_scale"), number_text(scale) + "; allowed: 0 with the box filter");
  return filter;
}

Integrator read_integrator(pb::Integrator integrator, const std::string& where, Problems& problems) {
  return value_of(kIntegrators,
                  read_enum(*pb::Integrator_descriptor(), integrator, pb::INTEGRATOR_PATH, where, problems));
}

Technique read_technique(const pb::Technique& message, const std::string& where, Problems& problems) {
  if (message.unweighted()) add_constant_problem("true", "false", field_path(where, "unweighted"), problems);
  return {message.light_vertices(), message.camera_vertices()};
}

RouletteRule read_roulette(pb::RouletteRule rule, const std::string& where, Problems& problems) {
  rule = read_enum(*pb::RouletteRule_descriptor(), rule, pb::ROULETTE_RULE_ROOT, where, problems);
  return rule == pb::ROULETTE_RULE_THROUGHPUT ? RouletteRule::throughput : RouletteRule::root;
}

RenderSettings read_settings(const pb::RenderSettings& message, const RenderLimits& limits, const std::string& where,
                             Problems& problems) {
  RenderSettings settings;
  if (message.width() != 0) settings.width = message.width();
  if (message.height() != 0) settings.height = message.height();
  settings.mode = value_of(
      kModes, read_enum(*pb::Mode_descriptor(), message.mode(), pb::MODE_PT, field_path(where, "mode"), problems));
  const pb::Variant variant = read_enum(*pb::Variant_descriptor(), message.variant(), pb::VARIANT_BOUNDED,
                                        field_path(where, "variant"), problems);
  settings.variant = variant == pb::VARIANT_PAPER ? ModeVariant::paper : ModeVariant::bounded;
  settings.integrator = read_integrator(message.integrator(), field_path(where, "integrator"), problems);
  if (message.has_technique())
    settings.technique = read_technique(message.technique(), field_path(where, "technique"), problems);
  settings.adaptive = read_adaptive(message.adaptive(), settings.variant, field_path(where, "adaptive"), problems);
  settings.reprojection =
      read_reprojection(message.reprojection(), settings.variant, field_path(where, "reprojection"), problems);
  settings.light_cache =
      read_light_cache(message.light_cache(), settings.integrator, field_path(where, "light_cache"), problems);
  settings.seed = message.seed();
  if (message.max_segments() != 0) settings.max_segments = message.max_segments();
  if (message.roulette_from() != 0) settings.roulette_from = message.roulette_from();
  settings.roulette = read_roulette(message.roulette(), field_path(where, "roulette"), problems);
  settings.filter = read_filter(message.filter(), message.filter_scale(), where, problems);
  settings.preview.rate = message.preview_rate();
  if (message.preview_budget_ms() != 0) settings.preview.budget_s = 1e-3 * message.preview_budget_ms();
  settings.preview.upscaling = message.preview_upscaling();
  settings.foveation.kind =
      value_of(kFoveations, read_enum(*pb::Foveation_descriptor(), message.foveation(), pb::FOVEATION_NONE,
                                      field_path(where, "foveation"), problems));
  if (message.viewing_distance() != 0 && settings.foveation.kind == Foveation::density)
    settings.foveation.viewing_distance = message.viewing_distance();
  if (settings.foveation.kind == Foveation::paper)
    settings.foveation.published = read_published_foveation(message.foveation_paper());
  if (!message.device().empty()) {
    if (const auto device = parse_render_device(message.device())) {
      settings.device = *device;
    } else {
      problems.add(field_path(where, "device"), "'" + message.device() + "'; allowed: " + kRenderDevices);
    }
  }
  if (message.has_region()) {
    const pb::Rect& region = message.region();
    settings.region = PixelRect{region.x0(), region.y0(), region.x1(), region.y1()};
  }
  validate(settings, RenderLimits{limits.max_film_side, std::numeric_limits<std::uint64_t>::max()}, where, problems);
  return settings;
}

Status check_film_size(const RenderSettings& settings, const RenderLimits& limits, const std::string& where) {
  const std::uint64_t pixels = std::uint64_t(settings.width) * std::uint64_t(settings.height);
  if (pixels <= limits.max_film_pixels) return ok_status();
  return Error{ErrorCode::resource_exhausted,
               fmt::format("{} x {} = {} pixels; allowed: max_film_pixels = {}", settings.width, settings.height,
                           pixels, limits.max_film_pixels),
               field_path(where, "width x height")};
}

Budget read_budget(const pb::Budget& message, const std::string& where, Problems& problems) {
  Budget budget;
  if (message.time_s() != 0) budget.time_s = message.time_s();
  if (message.samples() != 0) budget.samples = message.samples();
  if (message.error() != 0) budget.error = message.error();
  if (message.bytes_per_second() != 0) budget.bytes_per_second = message.bytes_per_second();
  check_constant_enum(*pb::ErrorMeasure_descriptor(), message.error_measure(), pb::ERROR_MEASURE_RMSE,
                      field_path(where, "error_measure"), problems);
  validate(budget, where, problems);
  return budget;
}

pb::Mode to_message(RenderMode mode) {
  return message_of(kModes, mode);
}

pb::Integrator to_message(Integrator integrator) {
  return message_of(kIntegrators, integrator);
}

pb::PixelFilter to_message(PixelFilterKind kind) {
  return message_of(kFilters, kind);
}

pb::RouletteRule to_message(RouletteRule rule) {
  return rule == RouletteRule::throughput ? pb::ROULETTE_RULE_THROUGHPUT : pb::ROULETTE_RULE_ROOT;
}

pb::LightCacheSettings to_message(const LightCacheSettings& cache) {
  pb::LightCacheSettings message;
  message.set_connections(std::uint32_t(cache.connections));
  message.set_radius(cache.radius);
  message.set_shrinking(cache.shrinking);
  return message;
}

pb::Technique to_message(const Technique& technique) {
  pb::Technique message;
  message.set_light_vertices(technique.light_vertices);
  message.set_camera_vertices(technique.camera_vertices);
  return message;
}

pb::RenderSettings to_message(const RenderSettings& settings) {
  pb::RenderSettings message;
  message.set_width(settings.width);
  message.set_height(settings.height);
  message.set_mode(to_message(settings.mode));
  message.set_integrator(to_message(settings.integrator));
  if (settings.technique) *message.mutable_technique() = to_message(*settings.technique);
  const bool paper = settings.variant == ModeVariant::paper;
  if (settings.mode != RenderMode::pt) message.set_variant(paper ? pb::VARIANT_PAPER : pb::VARIANT_BOUNDED);
  if (allocates(settings.mode)) {
    pb::AdaptiveSettings& adaptive = *message.mutable_adaptive();
    adaptive.set_min_samples(settings.adaptive.min_samples);
    if (paper) adaptive.set_max_samples(settings.adaptive.max_samples);
    adaptive.set_measure(settings.adaptive.measure == ErrorMeasure::relmse ? pb::ERROR_MEASURE_RELMSE
                                                                           : pb::ERROR_MEASURE_RMSE);
  }
  if (reuses(settings.mode) && paper) {
    message.mutable_reprojection()->set_stored_hits(std::uint32_t(settings.reprojection.stored_hits));
    message.mutable_reprojection()->set_max_error(settings.reprojection.max_error);
  } else if (reuses(settings.mode)) {
    message.mutable_reprojection()->set_mapping(pb::REPROJECTION_MAPPING_REVERSE);
  }
  if (caches_light_vertices(settings.integrator)) *message.mutable_light_cache() = to_message(settings.light_cache);
  message.set_seed(settings.seed);
  message.set_max_segments(settings.max_segments);
  message.set_roulette_from(settings.roulette_from);
  message.set_roulette(to_message(settings.roulette));
  message.set_filter(to_message(settings.filter.kind));
  if (settings.filter.kind != PixelFilterKind::box) message.set_filter_scale(settings.filter.scale);
  if (settings.region) write_rect(*settings.region, *message.mutable_region());
  message.set_device(to_string(settings.device));
  message.set_preview_rate(settings.preview.rate);
  if (settings.preview.rate > 0) message.set_preview_budget_ms(1e3 * settings.preview.budget_s);
  if (settings.preview.rate > 0) message.set_preview_upscaling(settings.preview.upscaling);
  message.set_foveation(message_of(kFoveations, settings.foveation.kind));
  if (settings.foveation.kind == Foveation::density)
    message.set_viewing_distance(settings.foveation.viewing_distance);
  if (settings.foveation.kind == Foveation::paper)
    write_published_foveation(settings.foveation.published, *message.mutable_foveation_paper());
  return message;
}

pb::Budget to_message(const Budget& budget) {
  pb::Budget message;
  message.set_time_s(budget.time_s.value_or(0));
  message.set_samples(budget.samples.value_or(0));
  message.set_error(budget.error.value_or(0));
  message.set_error_measure(pb::ERROR_MEASURE_RMSE);
  message.set_bytes_per_second(budget.bytes_per_second.value_or(0));
  return message;
}

void write_rect(const PixelRect& rect, pb::Rect& message) {
  message.set_x0(rect.x0);
  message.set_y0(rect.y0);
  message.set_x1(rect.x1);
  message.set_y1(rect.y1);
}

}  // namespace helio
