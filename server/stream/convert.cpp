#include "server/stream/convert.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <charconv>
#include <cmath>

#include "renderer/base/camera_limits.h"
#include "renderer/base/check.h"
#include "renderer/codec/jpeg_file.h"
#include "server/base/read_enum.h"
#include "server/stream/owned_message.h"

namespace helio {
namespace {

constexpr double kDefaultFov = 0.8;
constexpr std::size_t kMaxId = 64;
constexpr std::size_t kMaxShown = 128;

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
    problems.add(field_path(where, "target"), "is absent; required");
    return;
  }
  const std::size_t before = problems.size();
  const V3d target = read_position(message.target(), field_path(where, "target"), problems);
  const V3d up = message.has_up() ? read_position(message.up(), field_path(where, "up"), problems) : V3d(0, 1, 0);
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
    case FrameEndReason::preview:
      return pb::END_REASON_PREVIEW;
  }
  return pb::END_REASON_UNSPECIFIED;
}

}  // namespace

void check_id(const std::string& id, const std::string& where, Problems& problems) {
  if (id.empty() || id.size() > kMaxId) {
    problems.add(where,
                 fmt::format("{} bytes; allowed: an id of 1 to {} bytes as the daemon gave it", id.size(), kMaxId));
  }
}

TileFormat read_tile_format(const pb::TileFormat& message, const std::string& where, Problems& problems,
                            bool has_oidn) {
  TileFormat format;
  const pb::PixelType type = read_enum(*pb::PixelType_descriptor(), message.pixel_type(), pb::PIXEL_TYPE_HALF,
                                       field_path(where, "pixel_type"), problems);
  format.encoding.pixel_type = type == pb::PIXEL_TYPE_FLOAT ? TilePixelType::float32 : TilePixelType::half;
  static constexpr TileCompression kByNumber[] = {TileCompression::none, TileCompression::none, TileCompression::rle,
                                                  TileCompression::zips, TileCompression::zip,  TileCompression::piz,
                                                  TileCompression::dwaa};
  format.encoding.compression = kByNumber[read_enum(*pb::Compression_descriptor(), message.compression(),
                                                    pb::COMPRESSION_NONE, field_path(where, "compression"), problems)];
  format.channels = 0;
  for (const Channel& channel : channel_table()) {
    if (channel.bit == 0) continue;
    const std::string name = (channel.by_default ? "without_" : "") + std::string(channel.name);
    const auto* field = message.GetDescriptor()->FindFieldByName(name);
    HELIO_CHECK(field);  // the table's names are the protocol's
    if (message.GetReflection()->GetBool(message, field) != channel.by_default) format.channels |= channel.bit;
  }
  const std::string of_denoiser = field_path(where, "display_denoiser");
  const pb::Denoiser denoiser = read_enum(*pb::Denoiser_descriptor(), message.display_denoiser(),
                                          pb::DENOISER_UNSPECIFIED, of_denoiser, problems);
  if (denoiser == pb::DENOISER_OIDN) {
    if (!message.display())
      problems.add(of_denoiser, "DENOISER_OIDN (1) without display; allowed: beside display alone");
    if (!has_oidn) {
      problems.add(of_denoiser,
                   "DENOISER_OIDN (1), but this daemon has no Open Image Denoise, which its operator provides by "
                   "--oidn-library or HELIOGRAPH_OIDN; allowed: DENOISER_UNSPECIFIED (0), its own filter");
    }
    format.channels |= kDisplayByOidn;
  }
  if (message.preview_jpeg() > std::uint32_t(kLargestJpegQuality)) {
    problems.add(field_path(where, "preview_jpeg"),
                 fmt::format("{}; allowed: [0, {}]", message.preview_jpeg(), kLargestJpegQuality));
  } else {
    format.preview_jpeg = int(message.preview_jpeg());
  }
  constexpr std::uint32_t kRarestVariance = 1000;
  if (message.variance_every() > kRarestVariance) {
    problems.add(field_path(where, "variance_every"),
                 fmt::format("{}; allowed: [0, {}]", message.variance_every(), kRarestVariance));
  } else {
    format.variance_every = std::max(1, int(message.variance_every()));
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
    return find_camera(message.scene_camera(), cameras, field_path(where, "scene_camera"), problems);
  }

  const std::size_t before = problems.size();
  CameraPose pose;
  if (message.has_position()) {
    pose.position = read_position(message.position(), field_path(where, "position"), problems);
  } else {
    problems.add(field_path(where, "position"), "is absent; required unless scene_camera is given");
  }
  switch (message.orientation_case()) {
    case pb::CameraView::kLookAt:
      read_look_at(message.look_at(), field_path(where, "look_at"), pose, problems);
      break;
    case pb::CameraView::kRotation:
      read_rotation(message.rotation(), field_path(where, "rotation"), pose, problems);
      break;
    default:
      problems.add(where, "has no orientation; one of look_at, rotation, scene_camera is required");
  }

  const double fov = message.vertical_fov(), half_height = message.orthographic_half_height();
  if (half_height != 0) {
    pose.projection = Projection::orthographic;
    pose.half_height = half_height;
    if (!in_camera_length_range(half_height)) {
      refuse(problems, field_path(where, "orthographic_half_height"), half_height,
             fmt::format("{}, or 0 for perspective", kCameraLengthRange));
    }
    if (fov != 0) {
      refuse(problems, field_path(where, "vertical_fov"), fov, "0 (absent) beside orthographic_half_height");
    }
  } else {
    pose.vertical_fov = fov != 0 ? fov : kDefaultFov;
    if (!in_fov_range(pose.vertical_fov)) {
      refuse(problems, field_path(where, "vertical_fov"), fov, fmt::format("{}, or 0 for 0.8", kFovRange));
    }
  }
  pose.lens_radius = message.lens_radius();
  if (!in_lens_radius_range(pose.lens_radius)) {
    refuse(problems, field_path(where, "lens_radius"), pose.lens_radius, kLensRadiusRange);
  }
  if (message.focus_distance() != 0) pose.focus_distance = message.focus_distance();
  if (!in_camera_length_range(pose.focus_distance)) {
    refuse(problems, field_path(where, "focus_distance"), pose.focus_distance,
           fmt::format("{}, or 0 for 1", kCameraLengthRange));
  }
  pose.aspect = message.aspect();
  if (pose.aspect != 0 && !in_aspect_range(pose.aspect)) {
    refuse(problems, field_path(where, "aspect"), pose.aspect, kAspectRange);
  }
  if (problems.size() == before) validate(pose, where, problems);
  return pose;
}

namespace {

Gaze read_point(const pb::Gaze& message, const std::string& where, Problems& problems) {
  const Gaze gaze{message.x(), message.y()};
  validate(gaze, where, problems);
  return gaze;
}

}  // namespace

std::optional<Gaze> read_gaze(const pb::StreamRequest::MoveGaze& message, const std::string& where,
                              Problems& problems) {
  if (!message.has_gaze()) return std::nullopt;
  return read_point(message.gaze(), field_path(where, "gaze"), problems);
}

View read_view(const pb::View& message, const ViewRules& rules, const std::string& where, Problems& problems) {
  View view;
  view.id = message.id();
  constexpr std::uint64_t kEnd = 1ull << 63;
  if (view.id <= rules.last_view_id || view.id >= kEnd) {
    problems.add(field_path(where, "id"), fmt::format("{}; allowed: [{}, 2^63), larger than every id sent before",
                                                      view.id, rules.last_view_id + 1));
  }
  if (message.has_camera()) {
    view.camera = read_camera(message.camera(), *rules.cameras, field_path(where, "camera"), problems);
  } else {
    problems.add(field_path(where, "camera"), "is absent; required");
  }
  view.exposure = message.exposure();
  if (!kExposureStops.contains(view.exposure)) {
    refuse(problems, field_path(where, "exposure"), view.exposure, kExposureStops.to_string() + " stops");
  }
  view.time_s = message.time_s();
  if (!(view.time_s == rules.scene_time_s)) {
    problems.add(field_path(where, "time_s"), fmt::format("{}; allowed: {}, the time that the scene was loaded at",
                                                          view.time_s, rules.scene_time_s));
  }
  if (message.has_gaze()) view.gaze = read_point(message.gaze(), field_path(where, "gaze"), problems);
  return view;
}

pb::CameraView to_message(const CameraPose& pose) {
  pb::CameraView message;
  write_vector(pose.position, *message.mutable_position());
  const auto q = to_quaternion(pose.right, pose.up, -pose.forward);
  pb::CameraView::Quaternion rotation;
  rotation.set_x(q[0]);
  rotation.set_y(q[1]);
  rotation.set_z(q[2]);
  rotation.set_w(q[3]);
  message.set_allocated_rotation(owned_message(std::move(rotation)));
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
  message.set_preview(begin.preview);
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
  message.set_notice(end.notice);
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
  if (tile.jpeg) {
    message.set_jpeg_crc32(tile.crc32);
  } else {
    message.set_crc32(tile.crc32);
  }
  message.set_pass(tile.pass);
  message.set_final(tile.final);
  message.set_samples_per_pixel(tile.samples_per_pixel);
  message.set_invalid_samples(tile.invalid_samples);
  message.set_preview(tile.preview);
  return message;
}

}  // namespace helio
