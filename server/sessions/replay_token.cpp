#include "server/sessions/replay_token.h"

#include <absl/strings/escaping.h>
#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "renderer/trace/accel/traversal_isa.h"
#include "renderer/trace/paths/light_vertex_cache.h"
#include "server/base/build_info.h"
#include "server/base/parse_message.h"
#include "server/base/read_enum.h"
#include "server/stream/convert.h"

namespace helio {
namespace {

constexpr std::string_view kPrefix = "hg1-";
constexpr std::size_t kMaxToken = 4096;  // characters; what make_replay_token() gives has at most 700
constexpr std::size_t kMaxHint = 64;     // bytes of each name; what is longer loses its front
constexpr std::size_t kCrcBytes = 4;
constexpr std::uint64_t kMostLightPaths = std::uint64_t(1) << 32;  // a film's pixels are fewer; a pass has fewer still
constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

std::string crc_of(std::string_view bytes) {
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), uInt(bytes.size()));
  std::string text;
  for (std::size_t i = 0; i < kCrcBytes; ++i) text += char(crc >> (8 * i));
  return text;
}

// The end of a name, where files differ, starting at a character.
std::string hint(const std::string& name) {
  std::size_t start = name.size() > kMaxHint ? name.size() - kMaxHint : 0;
  while (start < name.size() && (std::uint8_t(name[start]) & 0xc0) == 0x80) ++start;
  return name.substr(start);
}

// All that bits depend on.
std::string build() {
  return fmt::format("{}, {}, {}, Embree {} by {}", build_version(), build_description(), build_isa(), embree_version(),
                     traversal_isa());
}

void write_vector(const V3d& v, pb::Vec3& message) {
  message.set_x(v.x);
  message.set_y(v.y);
  message.set_z(v.z);
}

V3d vector(const pb::Vec3& message) {
  return {message.x(), message.y(), message.z()};
}

Error no_token(std::string why, const std::string& where) {
  return {ErrorCode::invalid_argument, std::move(why), where};
}

Result<std::string> payload_of(const std::string& token, const std::string& where) {
  if (token.size() > kMaxToken) {
    return no_token(fmt::format("{} characters; allowed: at most {}", token.size(), kMaxToken), where);
  }
  if (!token.starts_with(kPrefix)) {
    return no_token(fmt::format("'{}'{} does not start like a replay token; allowed: '{}' and what follows it",
                                token.substr(0, 16), token.size() > 16 ? "..." : "", kPrefix),
                    where);
  }
  const std::string_view digits = std::string_view(token).substr(kPrefix.size());
  const std::size_t odd = digits.find_first_not_of(kDigits);
  if (odd != std::string_view::npos) {
    return no_token(fmt::format("character {} is none of a replay token; allowed: letters, digits, '-' and '_'",
                                kPrefix.size() + odd + 1),
                    where);
  }
  std::string bytes;
  absl::WebSafeBase64Unescape(absl::string_view(digits.data(), digits.size()),
                              &bytes);  // of a length that is none: nothing
  const std::size_t size = bytes.size() - std::min(bytes.size(), kCrcBytes);
  // Digits that hold no whole byte must be those that were written: every character counts.
  if (size == 0 || crc_of(std::string_view(bytes).substr(0, size)) != bytes.substr(size) ||
      absl::WebSafeBase64Escape(bytes) != digits) {
    return no_token("fails its checksum: cut short or mistyped; copy the whole of it", where);
  }
  return bytes.substr(0, size);
}

CameraPose read_pose(const pb::SampleReplay& message) {
  CameraPose pose;
  pose.position = vector(message.position());
  pose.right = vector(message.right());
  pose.up = vector(message.up());
  pose.forward = vector(message.forward());
  if (message.vertical_fov() != 0) {
    pose.vertical_fov = message.vertical_fov();
  } else {
    pose.projection = Projection::orthographic;
    pose.half_height = message.half_height();
  }
  pose.lens_radius = message.lens_radius();
  pose.focus_distance = message.focus_distance();
  return pose;
}

// Tiles are of one of two.
Integrator integrator_of(const RenderSettings& settings, const InvalidSample& sample) {
  if (settings.integrator != Integrator::pt_bdpt) return settings.integrator;
  return sample.light_paths > 0 ? Integrator::bdpt : Integrator::path;
}

Integrator read_integrator(const pb::SampleReplay& message, const std::string& where, Problems& problems) {
  const Integrator integrator = helio::read_integrator(message.integrator(), where + ".integrator", problems);
  if (integrator == Integrator::pt_bdpt) {
    problems.add(where + ".integrator",
                 fmt::format("{} makes no samples of its own; allowed: every other, or 0 for INTEGRATOR_PATH",
                             enum_text(*pb::Integrator_descriptor(), message.integrator())));
    return integrator;
  }
  const bool has_light_paths = integrator != Integrator::path, shared = caches_light_vertices(integrator);
  const std::uint64_t most = shared ? kMostPassPaths : kMostLightPaths;
  if (has_light_paths != (message.light_paths() > 0) || message.light_paths() > most) {
    problems.add(where + ".light_paths",
                 fmt::format("{} of integrator {}; allowed: {}", message.light_paths(), to_string(integrator),
                             has_light_paths ? fmt::format("[1, {}]", most) : std::string("0")));
  }
  const std::uint64_t path = message.sample().light_path();
  if (path > (shared ? message.light_paths() : 0)) {
    problems.add(where + ".sample.light_path",
                 fmt::format("{} of integrator {}; allowed: {}", path, to_string(integrator),
                             shared ? fmt::format("[0, {}]", message.light_paths()) : std::string("0")));
  }
  return integrator;
}

}  // namespace

std::string make_replay_token(const LoadedScene& scene, const FrameBegin& frame, const InvalidSample& sample) {
  pb::SampleReplay message;
  message.set_scene_id(scene.id);
  message.set_main_file(hint(scene.manifest.main_file));
  message.set_environment(hint(scene.manifest.environment));
  message.set_time_s(scene.manifest.time_s);
  message.set_animation(hint(scene.manifest.animation));
  message.set_build(build());
  const RenderSettings& settings = frame.settings;
  message.set_width(settings.width);
  message.set_height(settings.height);
  message.set_mode(to_message(settings.mode));
  if (const Integrator made = integrator_of(settings, sample); made != Integrator::path)
    message.set_integrator(to_message(made));
  message.set_light_paths(sample.light_paths);
  if (caches_light_vertices(settings.integrator)) *message.mutable_light_cache() = to_message(settings.light_cache);
  if (settings.technique) *message.mutable_technique() = to_message(*settings.technique);
  if (settings.device != RenderDevice{}) message.set_device(to_string(settings.device));
  message.set_seed(settings.seed);
  message.set_max_segments(settings.max_segments);
  message.set_roulette_from(settings.roulette_from);
  if (settings.roulette != RouletteRule::root) message.set_roulette(to_message(settings.roulette));
  if (settings.filter.kind != PixelFilterKind::box) {
    message.set_filter(to_message(settings.filter.kind));
    message.set_filter_scale(settings.filter.scale);
  }
  const CameraPose& pose = frame.camera;
  write_vector(pose.position, *message.mutable_position());
  write_vector(pose.right, *message.mutable_right());
  write_vector(pose.up, *message.mutable_up());
  write_vector(pose.forward, *message.mutable_forward());
  if (pose.projection == Projection::perspective) {
    message.set_vertical_fov(pose.vertical_fov);
  } else {
    message.set_half_height(pose.half_height);
  }
  message.set_lens_radius(pose.lens_radius);
  message.set_focus_distance(pose.focus_distance);
  message.mutable_sample()->set_x(sample.x);
  message.mutable_sample()->set_y(sample.y);
  message.mutable_sample()->set_half(sample.half);
  message.mutable_sample()->set_index(sample.index);
  message.mutable_sample()->set_light_path(sample.light_path);
  const std::string payload = message.SerializeAsString();
  return std::string(kPrefix) + absl::WebSafeBase64Escape(payload + crc_of(payload));
}

Result<Replay> read_replay_token(const std::string& token, const RenderLimits& limits, const std::string& where) {
  const auto payload = payload_of(token, where);
  if (!payload) return payload.error();
  Replay replay;
  const grpc::Slice slice(*payload);
  grpc::ByteBuffer bytes(&slice, 1);
  if (const Status parsed = parse_message(bytes, replay.message); !parsed.ok()) {
    return no_token("made by another version: " + parsed.error().message, where);
  }
  // Unlike a request, a token is of no use in part: the sample would be another.
  if (const auto unknown = unknown_fields(replay.message); !unknown.empty()) {
    return no_token("made by a newer version: this daemon does not know " + join_fields(unknown), where);
  }
  const pb::SampleReplay& message = replay.message;
  Problems problems;
  if (message.scene_id().empty()) problems.add(where + ".scene_id", "is empty; allowed: the id of a scene");
  // A sample is the same in all; in a round of samples where counts differ fewer paths share its packets, which may
  // show in a last bit.
  if (!pb::Mode_IsValid(message.mode()) || message.mode() == pb::MODE_UNSPECIFIED) {
    problems.add(where + ".mode", fmt::format("unknown value {}; allowed: MODE_PT (1), MODE_ADAPTIVE (2), "
                                              "MODE_REPROJECT (3), MODE_COMBINED (4)",
                                              int(message.mode())));
  }
  RenderSettings& settings = replay.settings;
  settings.width = message.width();
  settings.height = message.height();
  settings.integrator = read_integrator(message, where, problems);
  settings.seed = message.seed();
  settings.max_segments = message.max_segments();
  settings.roulette_from = message.roulette_from();
  settings.roulette = read_roulette(message.roulette(), where + ".roulette", problems);
  settings.light_cache = read_light_cache(message.light_cache(), settings.integrator, where + ".light_cache", problems);
  if (message.has_technique()) settings.technique = read_technique(message.technique(), where + ".technique", problems);
  if (message.mip_mapped()) add_constant_problem("true", "false", where + ".mip_mapped", problems);
  settings.filter = read_filter(message.filter(), message.filter_scale(), where, problems);
  // No film is made: only its sides matter.
  validate(settings, RenderLimits{limits.max_film_side, std::numeric_limits<std::uint64_t>::max()}, where, problems);
  replay.camera = read_pose(message);
  validate(replay.camera, where, problems);
  const pb::SampleId& sample = message.sample();
  replay.sample = {sample.x(), sample.y(), sample.half(), sample.index(), message.light_paths(), sample.light_path()};
  if (!PixelRect{0, 0, settings.width, settings.height}.contains(sample.x(), sample.y())) {
    problems.add(where + ".sample", fmt::format("pixel {},{}; allowed: inside the film of {}x{}", sample.x(),
                                                sample.y(), settings.width, settings.height));
  }
  if (sample.half() < 0 || sample.half() >= kHalves) {
    problems.add(where + ".sample.half", fmt::format("{}; allowed: 0 or 1", sample.half()));
  }
  if (!problems.empty()) return problems.to_error();
  return replay;
}

std::string replay_note(const pb::SampleReplay& message) {
  std::vector<std::string> reasons;
  if (message.build() != build()) {
    reasons.push_back(
        fmt::format("rendered by another build ({}; this is {}): bits may differ", message.build(), build()));
  }
  if (!message.device().empty()) {
    reasons.push_back(fmt::format("rendered on {}, traced again on the CPU, which rounds in other places: bits may "
                                  "differ, and what is invalid there may be valid here",
                                  message.device()));
  }
  return fmt::format("{}", fmt::join(reasons, "; "));
}

}  // namespace helio
