#include "server/stream/convert.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "renderer/base/camera_limits.h"
#include "renderer/base/check.h"

namespace helio {
namespace {

constexpr double kDefaultFov = 0.8;
constexpr std::size_t kMaxId = 64;
constexpr std::size_t kMaxShown = 128;

std::string at(const std::string& where, const char* field) {
  return where.empty() ? field : where + "." + field;
}

std::string shown(const std::string& text) {
  return text.size() <= kMaxShown ? "'" + text + "'" : "'" + text.substr(0, kMaxShown) + "...'";
}

void refuse(Problems& problems, const std::string& where, double value, const std::string& allowed) {
  problems.add(where, fmt::format("{}; allowed: {}", value, allowed));
}

V3d read_position(const pb::Vec3& message, const std::string& where, Problems& problems) {
  const V3d v(message.x(), message.y(), message.z());
  if (!in_coordinate_range(v)) {
    problems.add(where, fmt::format("({}, {}, {}); allowed: finite numbers in {}", v.x, v.y, v.z, kCoordinateRange));
  }
  return v;
}

void write_vector(const V3d& v, pb::Vec3& message) {
  message.set_x(v.x);
  message.set_y(v.y);
  message.set_z(v.z);
}

// Checks an enum that may hold any number on the wire.
template <class Enum>
bool known(bool valid, Enum value, const char* allowed, const std::string& where, Problems& problems) {
  if (!valid) problems.add(where, fmt::format("unknown value {}; allowed: {}", static_cast<int>(value), allowed));
  return valid;
}

constexpr std::pair<RenderMode, pb::Mode> kModes[] = {{RenderMode::pt, pb::MODE_PT},
                                                      {RenderMode::adaptive, pb::MODE_ADAPTIVE},
                                                      {RenderMode::reproject, pb::MODE_REPROJECT},
                                                      {RenderMode::combined, pb::MODE_COMBINED}};
static_assert(std::size(kModes) == std::size(kEveryRenderMode));

RenderMode read_mode(pb::Mode message, const std::string& where, Problems& problems) {
  known(pb::Mode_IsValid(message), message,
        "MODE_PT (1), MODE_ADAPTIVE (2), MODE_REPROJECT (3), MODE_COMBINED (4), or 0 for MODE_PT", where, problems);
  for (const auto& [mode, number] : kModes) {
    if (number == message) return mode;
  }
  return RenderMode::pt;
}

constexpr std::pair<Integrator, pb::Integrator> kIntegrators[] = {
    {Integrator::path, pb::INTEGRATOR_PATH},    {Integrator::light, pb::INTEGRATOR_LIGHT},
    {Integrator::bdpt, pb::INTEGRATOR_BDPT},    {Integrator::pt_bdpt, pb::INTEGRATOR_PT_BDPT},
    {Integrator::lvc, pb::INTEGRATOR_LVC},      {Integrator::vcm, pb::INTEGRATOR_VCM},
    {Integrator::photon, pb::INTEGRATOR_PHOTON}};
static_assert(std::size(kIntegrators) == std::size(kEveryIntegrator));

Integrator read_integrator(pb::Integrator message, const std::string& where, Problems& problems) {
  known(pb::Integrator_IsValid(message), message,
        "INTEGRATOR_PATH (1), INTEGRATOR_LIGHT (2), INTEGRATOR_BDPT (3), INTEGRATOR_PT_BDPT (4), "
        "INTEGRATOR_LVC (5), INTEGRATOR_VCM (6), INTEGRATOR_PHOTON (7), or 0 for INTEGRATOR_PATH",
        where, problems);
  for (const auto& [integrator, number] : kIntegrators) {
    if (number == message) return integrator;
  }
  return Integrator::path;
}

CameraPose find_camera(const std::string& name, const std::vector<CameraDescription>& cameras, const std::string& where,
                       Problems& problems) {
  for (const CameraDescription& camera : cameras) {
    if (camera.name == name) return camera_pose(camera);
  }
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error == std::errc() && end == name.data() + name.size() && number < cameras.size()) {
    return camera_pose(cameras[number]);
  }
  problems.add(where, fmt::format("{}; allowed: the name of a camera of the scene, or a number from 0 to {}",
                                  shown(name), cameras.empty() ? 0 : cameras.size() - 1));
  return {};
}

V3d rotate(const V3d& axis, double w, const V3d& v) {  // by the unit quaternion (axis, w)
  const V3d t = cross(axis, v) * 2.0;
  return v + t * w + cross(axis, t);
}

void read_rotation(const pb::CameraView::Quaternion& message, const std::string& where, CameraPose& pose,
                   Problems& problems) {
  V3d axis(message.x(), message.y(), message.z());
  double w = message.w();
  const double norm = std::sqrt(dot(axis, axis) + w * w);
  if (!(std::abs(norm - 1) <= 1e-3)) {
    problems.add(where, fmt::format("({}, {}, {}, {}) has length {}; allowed: within 0.001 of 1", axis.x, axis.y,
                                    axis.z, w, norm));
    return;
  }
  axis /= norm;
  w /= norm;
  pose.right = rotate(axis, w, V3d(1, 0, 0));
  pose.up = rotate(axis, w, V3d(0, 1, 0));
  pose.forward = rotate(axis, w, V3d(0, 0, -1));
}

void read_look_at(const pb::CameraView::LookAt& message, const std::string& where, CameraPose& pose,
                  Problems& problems) {
  if (!message.has_target()) {
    problems.add(at(where, "target"), "is absent; required");
    return;
  }
  const std::size_t before = problems.size();
  const V3d target = read_position(message.target(), at(where, "target"), problems);
  const V3d up = message.has_up() ? read_position(message.up(), at(where, "up"), problems) : V3d(0, 1, 0);
  if (problems.size() != before || !in_coordinate_range(pose.position)) return;
  auto looking = look_at(pose.position, target, up, kDefaultFov);
  if (!looking) {
    problems.add(where, looking.error().to_string());
    return;
  }
  pose.right = looking->right;
  pose.up = looking->up;
  pose.forward = looking->forward;
}

// Unit quaternion (x, y, z, w) of the rotation whose columns are the images of the axes (Shepperd 1978: the largest of
// the four is found first, so that no small number is divided by).
std::array<double, 4> to_quaternion(const V3d& cx, const V3d& cy, const V3d& cz) {
  const double trace = cx.x + cy.y + cz.z;
  std::array<double, 4> q;
  if (trace >= cx.x && trace >= cy.y && trace >= cz.z) {
    q = {cy.z - cz.y, cz.x - cx.z, cx.y - cy.x, 1 + trace};
  } else if (cx.x >= cy.y && cx.x >= cz.z) {
    q = {1 + 2 * cx.x - trace, cx.y + cy.x, cz.x + cx.z, cy.z - cz.y};
  } else if (cy.y >= cz.z) {
    q = {cx.y + cy.x, 1 + 2 * cy.y - trace, cy.z + cz.y, cz.x - cx.z};
  } else {
    q = {cz.x + cx.z, cy.z + cz.y, 1 + 2 * cz.z - trace, cx.y - cy.x};
  }
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& value : q) value /= norm;
  return q;
}

pb::EndReason to_message(FrameEndReason reason) {
  switch (reason) {
    case FrameEndReason::samples:
      return pb::END_REASON_SAMPLES;
    case FrameEndReason::time:
      return pb::END_REASON_TIME;
    case FrameEndReason::error:
      return pb::END_REASON_ERROR;
    case FrameEndReason::superseded:
      return pb::END_REASON_SUPERSEDED;
    case FrameEndReason::cancelled:
      return pb::END_REASON_CANCELLED;
    case FrameEndReason::failed:
      return pb::END_REASON_FAILED;
  }
  return pb::END_REASON_UNSPECIFIED;
}

pb::ErrorMeasure to_message(ErrorMeasure measure) {
  return measure == ErrorMeasure::relmse ? pb::ERROR_MEASURE_RELMSE : pb::ERROR_MEASURE_RMSE;
}

}  // namespace

void write_rect(const PixelRect& rect, pb::Rect& message) {
  message.set_x0(rect.x0);
  message.set_y0(rect.y0);
  message.set_x1(rect.x1);
  message.set_y1(rect.y1);
}

void check_id(const std::string& id, const std::string& where, Problems& problems) {
  if (id.empty() || id.size() > kMaxId) {
    problems.add(where,
                 fmt::format("{} bytes; allowed: an id of 1 to {} bytes as the daemon gave it", id.size(), kMaxId));
  }
}

static AdaptiveSettings read_adaptive(const pb::AdaptiveSettings& message, ModeVariant variant,
                                      const std::string& where, Problems& problems) {
  AdaptiveSettings adaptive;
  if (variant == ModeVariant::paper) adaptive.min_samples = kPaperMinSamples;
  if (message.min_samples() != 0) adaptive.min_samples = message.min_samples();
  if (message.max_samples() != 0) adaptive.max_samples = message.max_samples();
  if (known(pb::ErrorMeasure_IsValid(message.measure()), message.measure(),
            "ERROR_MEASURE_RMSE (1), ERROR_MEASURE_RELMSE (2), or 0 for RELMSE", at(where, "measure"), problems)) {
    adaptive.measure = message.measure() == pb::ERROR_MEASURE_RMSE ? ErrorMeasure::rmse : ErrorMeasure::relmse;
  }
  return adaptive;
}

LightCacheSettings read_light_cache(const pb::LightCacheSettings& message, Integrator integrator) {
  LightCacheSettings cache;
  if (!caches_light_vertices(integrator)) return cache;
  if (message.connections() != 0)
    cache.connections = int(std::min<std::uint32_t>(message.connections(), std::numeric_limits<int>::max()));
  if (message.radius() != 0) cache.radius = message.radius();
  if (message.shrinking() != 0) cache.shrinking = message.shrinking();
  return cache;
}

pb::LightCacheSettings to_message(const LightCacheSettings& cache) {
  pb::LightCacheSettings message;
  message.set_connections(std::uint32_t(cache.connections));
  message.set_radius(cache.radius);
  message.set_shrinking(cache.shrinking);
  return message;
}

static ReprojectionSettings read_reprojection(const pb::ReprojectionSettings& message, ModeVariant variant,
                                              const std::string& where, Problems& problems) {
  ReprojectionSettings reprojection;
  if (message.mapping() == pb::REPROJECTION_MAPPING_FORWARD) {
    problems.add(
        at(where, "mapping"),
        "REPROJECTION_MAPPING_FORWARD (2) was removed; allowed: REPROJECTION_MAPPING_REVERSE (1), or 0 for that");
  } else {
    known(pb::ReprojectionMapping_IsValid(message.mapping()), message.mapping(),
          "REPROJECTION_MAPPING_REVERSE (1), or 0 for that", at(where, "mapping"), problems);
  }
  if (variant != ModeVariant::paper) return reprojection;
  if (message.stored_hits() != 0)  // what no int holds is refused as well
    reprojection.stored_hits = int(std::min<std::uint32_t>(message.stored_hits(), std::numeric_limits<int>::max()));
  if (message.max_error() != 0) reprojection.max_error = message.max_error();
  return reprojection;
}

PixelFilter read_filter(pb::PixelFilter kind, double scale, const std::string& where, Problems& problems) {
  PixelFilter filter;
  known(pb::PixelFilter_IsValid(kind), kind,
        "PIXEL_FILTER_BOX (1), PIXEL_FILTER_TENT (2), PIXEL_FILTER_GAUSSIAN (3), or 0 for PIXEL_FILTER_BOX",
        at(where, "filter"), problems);
  if (kind == pb::PIXEL_FILTER_TENT) filter.kind = PixelFilterKind::tent;
  if (kind == pb::PIXEL_FILTER_GAUSSIAN) filter.kind = PixelFilterKind::gaussian;
  filter.scale = scale != 0 ? scale : default_pixel_filter_scale(filter.kind);
  if ((kind == pb::PIXEL_FILTER_UNSPECIFIED || kind == pb::PIXEL_FILTER_BOX) && scale != 0) {
    refuse(problems, at(where, "filter_scale"), scale, "0 with the box filter");
  }
  return filter;
}

pb::PixelFilter to_message(PixelFilterKind kind) {
  switch (kind) {
    case PixelFilterKind::box:
      return pb::PIXEL_FILTER_BOX;
    case PixelFilterKind::tent:
      return pb::PIXEL_FILTER_TENT;
    case PixelFilterKind::gaussian:
      return pb::PIXEL_FILTER_GAUSSIAN;
  }
  return pb::PIXEL_FILTER_UNSPECIFIED;
}

Technique read_technique(const pb::Technique& message) {
  return {message.light_vertices(), message.camera_vertices(), message.unweighted()};
}

RenderSettings read_settings(const pb::RenderSettings& message, const RenderLimits& limits, const std::string& where,
                             Problems& problems) {
  RenderSettings settings;
  if (message.width() != 0) settings.width = message.width();
  if (message.height() != 0) settings.height = message.height();
  settings.mode = read_mode(message.mode(), at(where, "mode"), problems);
  known(pb::Variant_IsValid(message.variant()), message.variant(),
        "VARIANT_BOUNDED (1), VARIANT_PAPER (2), or 0 for VARIANT_BOUNDED", at(where, "variant"), problems);
  settings.variant = message.variant() == pb::VARIANT_PAPER ? ModeVariant::paper : ModeVariant::bounded;
  settings.integrator = read_integrator(message.integrator(), at(where, "integrator"), problems);
  if (message.has_technique()) settings.technique = read_technique(message.technique());
  settings.adaptive = read_adaptive(message.adaptive(), settings.variant, at(where, "adaptive"), problems);
  settings.reprojection =
      read_reprojection(message.reprojection(), settings.variant, at(where, "reprojection"), problems);
  settings.light_cache = read_light_cache(message.light_cache(), settings.integrator);
  settings.seed = message.seed();
  if (message.max_segments() != 0) settings.max_segments = message.max_segments();
  if (message.roulette_from() != 0) settings.roulette_from = message.roulette_from();
  settings.filter = read_filter(message.filter(), message.filter_scale(), where, problems);
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
               at(where, "width x height")};
}

Budget read_budget(const pb::Budget& message, const std::string& where, Problems& problems) {
  Budget budget;
  if (message.time_s() != 0) budget.time_s = message.time_s();
  if (message.samples() != 0) budget.samples = message.samples();
  if (message.error() != 0) budget.error = message.error();
  if (message.bytes_per_second() != 0) budget.bytes_per_second = message.bytes_per_second();
  if (known(pb::ErrorMeasure_IsValid(message.error_measure()), message.error_measure(),
            "ERROR_MEASURE_RMSE (1), ERROR_MEASURE_RELMSE (2), or 0 for RMSE", at(where, "error_measure"), problems)) {
    budget.error_measure =
        message.error_measure() == pb::ERROR_MEASURE_RELMSE ? ErrorMeasure::relmse : ErrorMeasure::rmse;
  }
  validate(budget, where, problems);
  return budget;
}

TileFormat read_tile_format(const pb::TileFormat& message, const std::string& where, Problems& problems) {
  TileFormat format;
  if (known(pb::PixelType_IsValid(message.pixel_type()), message.pixel_type(),
            "PIXEL_TYPE_HALF (1), PIXEL_TYPE_FLOAT (2), or 0 for half", at(where, "pixel_type"), problems)) {
    format.encoding.pixel_type =
        message.pixel_type() == pb::PIXEL_TYPE_FLOAT ? TilePixelType::float32 : TilePixelType::half;
  }
  if (known(pb::Compression_IsValid(message.compression()), message.compression(),
            "COMPRESSION_NONE (1) to COMPRESSION_DWAA (6), or 0 for none", at(where, "compression"), problems)) {
    static constexpr TileCompression kByNumber[] = {TileCompression::none, TileCompression::none, TileCompression::rle,
                                                    TileCompression::zips, TileCompression::zip,  TileCompression::piz,
                                                    TileCompression::dwaa};
    format.encoding.compression = kByNumber[message.compression()];
  }
  format.channels = 0;
  for (const Channel& channel : channel_table()) {
    if (channel.bit == 0) continue;
    const std::string name = (channel.by_default ? "without_" : "") + std::string(channel.name);
    const auto* field = message.GetDescriptor()->FindFieldByName(name);
    HELIO_CHECK(field);  // the table's names are the protocol's
    if (message.GetReflection()->GetBool(message, field) != channel.by_default) format.channels |= channel.bit;
  }
  return format;
}

CameraPose read_camera(const pb::CameraView& message, const std::vector<CameraDescription>& cameras,
                       const std::string& where, Problems& problems) {
  if (message.orientation_case() == pb::CameraView::kSceneCamera) {
    if (message.has_position() || message.vertical_fov() != 0 || message.orthographic_half_height() != 0 ||
        message.lens_radius() != 0 || message.focus_distance() != 0 || message.aspect() != 0) {
      problems.add(where, "scene_camera is given beside other fields; allowed: scene_camera alone");
    }
    return find_camera(message.scene_camera(), cameras, at(where, "scene_camera"), problems);
  }

  const std::size_t before = problems.size();
  CameraPose pose;
  if (message.has_position()) {
    pose.position = read_position(message.position(), at(where, "position"), problems);
  } else {
    problems.add(at(where, "position"), "is absent; required unless scene_camera is given");
  }
  switch (message.orientation_case()) {
    case pb::CameraView::kLookAt:
      read_look_at(message.look_at(), at(where, "look_at"), pose, problems);
      break;
    case pb::CameraView::kRotation:
      read_rotation(message.rotation(), at(where, "rotation"), pose, problems);
      break;
    default:
      problems.add(where, "has no orientation; one of look_at, rotation, scene_camera is required");
  }

  const double fov = message.vertical_fov(), half_height = message.orthographic_half_height();
  if (half_height != 0) {
    pose.projection = Projection::orthographic;
    pose.half_height = half_height;
    if (!in_camera_length_range(half_height)) {
      refuse(problems, at(where, "orthographic_half_height"), half_height,
             fmt::format("{}, or 0 for perspective", kCameraLengthRange));
    }
    if (fov != 0) {
      refuse(problems, at(where, "vertical_fov"), fov, "0 (absent) beside orthographic_half_height");
    }
  } else {
    pose.vertical_fov = fov != 0 ? fov : kDefaultFov;
    if (!in_fov_range(pose.vertical_fov)) {
      refuse(problems, at(where, "vertical_fov"), fov, fmt::format("{}, or 0 for 0.8", kFovRange));
    }
  }
  pose.lens_radius = message.lens_radius();
  if (!in_lens_radius_range(pose.lens_radius)) {
    refuse(problems, at(where, "lens_radius"), pose.lens_radius, kLensRadiusRange);
  }
  if (message.focus_distance() != 0) pose.focus_distance = message.focus_distance();
  if (!in_camera_length_range(pose.focus_distance)) {
    refuse(problems, at(where, "focus_distance"), pose.focus_distance,
           fmt::format("{}, or 0 for 1", kCameraLengthRange));
  }
  pose.aspect = message.aspect();
  if (pose.aspect != 0 && !in_aspect_range(pose.aspect)) {
    refuse(problems, at(where, "aspect"), pose.aspect, kAspectRange);
  }
  if (problems.size() == before) validate(pose, where, problems);
  return pose;
}

View read_view(const pb::View& message, const ViewRules& rules, const std::string& where, Problems& problems) {
  View view;
  view.id = message.id();
  constexpr std::uint64_t kEnd = 1ull << 63;
  if (view.id <= rules.last_view_id || view.id >= kEnd) {
    problems.add(at(where, "id"), fmt::format("{}; allowed: [{}, 2^63), larger than every id sent before", view.id,
                                              rules.last_view_id + 1));
  }
  if (message.has_camera()) {
    view.camera = read_camera(message.camera(), *rules.cameras, at(where, "camera"), problems);
  } else {
    problems.add(at(where, "camera"), "is absent; required");
  }
  view.exposure = message.exposure();
  if (!(std::abs(view.exposure) <= 64)) {
    refuse(problems, at(where, "exposure"), view.exposure, "[-64, 64] stops");
  }
  view.time_s = message.time_s();
  if (!(view.time_s == rules.scene_time_s)) {
    problems.add(at(where, "time_s"), fmt::format("{}; allowed: {}, the time that the scene was loaded at", view.time_s,
                                                  rules.scene_time_s));
  }
  return view;
}

pb::Mode to_message(RenderMode mode) {
  for (const auto& [value, message] : kModes) {
    if (value == mode) return message;
  }
  return pb::MODE_UNSPECIFIED;
}

pb::Integrator to_message(Integrator integrator) {
  for (const auto& [value, message] : kIntegrators) {
    if (value == integrator) return message;
  }
  return pb::INTEGRATOR_UNSPECIFIED;
}

pb::Technique to_message(const Technique& technique) {
  pb::Technique message;
  message.set_light_vertices(technique.light_vertices);
  message.set_camera_vertices(technique.camera_vertices);
  message.set_unweighted(technique.unweighted);
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
    adaptive.set_measure(to_message(settings.adaptive.measure));
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
  message.set_filter(to_message(settings.filter.kind));
  if (settings.filter.kind != PixelFilterKind::box) message.set_filter_scale(settings.filter.scale);
  if (settings.region) write_rect(*settings.region, *message.mutable_region());
  return message;
}

pb::Budget to_message(const Budget& budget) {
  pb::Budget message;
  message.set_time_s(budget.time_s.value_or(0));
  message.set_samples(budget.samples.value_or(0));
  message.set_error(budget.error.value_or(0));
  message.set_error_measure(to_message(budget.error_measure));
  message.set_bytes_per_second(budget.bytes_per_second.value_or(0));
  return message;
}

pb::CameraView to_message(const CameraPose& pose) {
  pb::CameraView message;
  write_vector(pose.position, *message.mutable_position());
  const auto q = to_quaternion(pose.right, pose.up, -pose.forward);
  pb::CameraView::Quaternion& rotation = *message.mutable_rotation();
  rotation.set_x(q[0]);
  rotation.set_y(q[1]);
  rotation.set_z(q[2]);
  rotation.set_w(q[3]);
  if (pose.projection == Projection::orthographic) {
    message.set_orthographic_half_height(pose.half_height);
  } else {
    message.set_vertical_fov(pose.vertical_fov);
  }
  message.set_lens_radius(pose.lens_radius);
  message.set_focus_distance(pose.focus_distance);
  message.set_aspect(pose.aspect);
  return message;
}

pb::FrameTag to_message(const FrameTag& tag, const std::string& session_id) {
  pb::FrameTag message;
  message.set_session_id(session_id);
  message.set_revision(tag.revision);
  message.set_view_id(tag.view_id);
  message.set_frame(tag.frame);
  return message;
}

pb::FrameBegin to_message(const FrameBegin& begin, const std::string& session_id) {
  pb::FrameBegin message;
  *message.mutable_tag() = to_message(begin.tag, session_id);
  *message.mutable_settings() = to_message(begin.settings);
  message.mutable_unsampled()->Assign(begin.unsampled.begin(), begin.unsampled.end());
  if (!begin.notice.empty()) message.add_notices(begin.notice);
  return message;
}

pb::Progress to_message(const FrameProgress& progress, const std::string& session_id) {
  pb::Progress message;
  *message.mutable_tag() = to_message(progress.tag, session_id);
  message.set_seconds(progress.seconds);
  message.set_samples_per_pixel(progress.samples_per_pixel);
  message.set_samples_per_second(progress.samples_per_second);
  message.set_rays(progress.trace.rays);
  message.set_paths(progress.trace.paths);
  message.set_light_paths(progress.trace.light_paths);
  message.set_invalid_samples(progress.trace.invalid_samples + progress.trace.invalid_splats);
  message.set_media_overflows(progress.trace.media_overflows);
  pb::ErrorEstimate& error = *message.mutable_error();
  error.set_known(progress.error.known);
  if (progress.error.known) {
    error.set_rmse(progress.error.rmse);
    error.set_relmse(progress.error.relmse);
    error.set_worst_tile_rmse(progress.error.worst_tile_rmse);
  }
  error.set_bias(progress.error.bias);
  error.set_bias_error(progress.error.bias_error);
  error.set_unproven(progress.error.unproven);
  error.set_all_black(progress.error.known && std::isinf(progress.error.hidden_rmse));
  if (progress.error.known && !error.all_black()) {
    error.set_hidden_rmse(progress.error.hidden_rmse);
    error.set_hidden_relmse(progress.error.hidden_relmse);
  }
  message.set_budget_used(progress.budget_used);
  message.set_reuse_share(progress.reuse_share);
  message.set_verification_rays(progress.verification_rays);
  return message;
}

pb::FrameEnd to_message(const FrameReport& report, const std::string& session_id) {
  const FrameEnd& end = report.end;
  pb::FrameEnd message;
  *message.mutable_tag() = to_message(end.tag, session_id);
  message.set_reason(to_message(end.reason));
  message.set_message(end.message);
  *message.mutable_totals() = to_message(end.progress, session_id);
  message.set_first_tile_seconds(end.first_tile_seconds);
  for (const PassTime& pass : end.passes) {
    pb::PassTime& entry = *message.add_passes();
    entry.set_pass(pass.pass);
    entry.set_seconds(pass.seconds);
  }
  message.set_bytes_sent(report.bytes_sent);
  message.set_dropped_tiles(report.dropped_tiles);
  if (end.progress.trace.invalid() > 0) {
    const InvalidSample& invalid = end.progress.trace.first_invalid;
    pb::SampleId& first = *message.mutable_first_invalid();
    first.set_x(invalid.x);
    first.set_y(invalid.y);
    first.set_half(invalid.half);
    first.set_index(invalid.index);
    first.set_light_path(invalid.light_path);
    message.set_replay_token(report.replay_token);
  }
  return message;
}

pb::Notice to_message(const Notice& notice) {
  pb::Notice message;
  switch (notice.severity) {
    case NoticeSeverity::info:
      message.set_severity(pb::Notice::SEVERITY_INFO);
      break;
    case NoticeSeverity::warning:
      message.set_severity(pb::Notice::SEVERITY_WARNING);
      break;
    case NoticeSeverity::draining:
      message.set_severity(pb::Notice::SEVERITY_DRAINING);
      break;
  }
  message.set_text(notice.text);
  return message;
}

pb::Tile to_message(const EncodedTile& tile, const std::string& session_id) {
  pb::Tile message;
  *message.mutable_tag() = to_message(tile.tag, session_id);
  write_rect(tile.window, *message.mutable_window());
  message.set_crc32(tile.crc32);
  message.set_pass(tile.pass);
  message.set_final(tile.final);
  message.set_samples_per_pixel(tile.samples_per_pixel);
  message.set_invalid_samples(tile.invalid_samples);
  return message;
}

}  // namespace helio
