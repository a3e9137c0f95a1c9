#include "client/cli/render_options.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include "client/camera_path.h"
#include "client/cli/scene_options.h"
#include "client/enum_names.h"
#include "client/server_address.h"
#include "renderer/base/check.h"
#include "server/stream/settings_messages.h"

namespace helio::cli {

namespace {

constexpr std::uint32_t kDefaultSamples = 64;
constexpr int kDefaultWidth = 1280, kDefaultHeight = 720;

// An option that sets one field of the message. "{}" in the help: its range, or the names that it may have.
struct FieldOption {
  const char *path, *flag, *value, *help;
  bool any_picture = false;  // commands that choose the integrator themselves have it too
};
// Which fields count depends on the first three.
constexpr FieldOption kFieldOptions[] = {
    {"mode", "--mode", "MODE",
     "Rendering mode: {}. adaptive chooses sample counts by noise and cost; reproject reuses samples of earlier views; "
     "combined does both. Default: pt; of move: combined"},
    {"variant", "--variant", "VARIANT",
     "Method of every --mode but pt: bounded, or paper for the published method (Schalk 2018), biased and without an "
     "error bound. Default: bounded"},
    {"integrator", "--integrator", "INTEGRATOR",
     "Light transport: path, unidirectional; light, light tracing, which misses what mirrors and glass show; bdpt, "
     "bidirectional; pt+bdpt, path or bdpt per tile, whichever is more efficient; lvc, bdpt with a light vertex cache; "
     "vcm, lvc with vertex merging (biased); photon, progressive photon mapping (biased). All go with --mode pt; bdpt "
     "and pt+bdpt with every mode of --variant bounded, light also with its adaptive. Default: path"},
    {"max_segments", "--max-segments", "N",
     "Maximum path length in segments, the camera segment included, {}; at most 256 with every --integrator but path. "
     "Default: the scene file's, else 10"},
    {"roulette_from", "--roulette-from", "VERTEX",
     "First vertex at which Russian roulette may end a path, {}. Default: the scene file's, else 3", true},
    {"roulette", "--roulette", "RULE",
     "Probability of surviving Russian roulette: root, of the path's throughput, or throughput, as other renderers "
     "have it. Default: root",
     true},
    {"light_cache.connections", "--connections", "N",
     "Number of light vertices that each camera vertex is connected to (--integrator lvc and vcm), {}. Default: 2"},
    {"light_cache.radius", "--merging-radius", "R",
     "Merging radius of the first samples (--integrator vcm and photon), as a share of the scene's radius, {}. "
     "Default: 0.003"},
    {"adaptive.min_samples", "--adaptive-min", "N",
     "Samples that every pixel gets before counts differ (--mode adaptive and combined), even, {}; paper: from 2. "
     "Default: 16, paper 4"},
    {"adaptive.max_samples", "--adaptive-max", "N",
     "Iterations after which the error threshold reaches 0 (--mode adaptive and combined with --variant paper), more "
     "than --adaptive-min, {}. Default: 32"},
    {"adaptive.measure", "--adaptive-measure", "MEASURE",
     "Error that adaptive sampling minimises (--mode adaptive and combined): relmse, or rmse, which --error is in. "
     "Default: relmse"},
    {"reprojection.stored_hits", "--stored-hits", "N",
     "First hits kept per pixel (--mode reproject and combined with --variant paper): 1 or 4. Default: 4"},
    {"reprojection.max_error", "--max-reuse-error", "E",
     "Reprojection error above which a pixel is not reused, Schalk 2018 eq. 15 (--mode reproject and combined with "
     "--variant paper), radiance, {}. Default: 1/256"}};

struct FieldPlace {
  google::protobuf::Message* message;
  const google::protobuf::FieldDescriptor* field;
};

// Makes the messages on the way.
FieldPlace place_of(google::protobuf::Message& message, std::string_view path) {
  const std::size_t dot = path.find('.');
  const auto* field = message.GetDescriptor()->FindFieldByName(std::string(path.substr(0, dot)));
  HELIO_CHECK(field);
  if (dot == std::string_view::npos) return {&message, field};
  return place_of(*message.GetReflection()->MutableMessage(&message, field), path.substr(dot + 1));
}

// Enumerations by their short names, numbers within `range`.
void read_field(const char* path, const TextOption& option, const NumberRange& range,
                google::protobuf::Message& message, OptionReader& reader) {
  if (!option.given()) return;
  using Field = google::protobuf::FieldDescriptor;
  const auto [holder, field] = place_of(message, path);
  const google::protobuf::Reflection& reflection = *holder->GetReflection();
  if (field->cpp_type() == Field::CPPTYPE_ENUM) {
    const auto name = reader.choice(option, short_names(*field->enum_type()));
    if (name) reflection.SetEnumValue(holder, field, *enum_number(*field->enum_type(), *name));
  } else if (field->cpp_type() == Field::CPPTYPE_DOUBLE) {
    if (const auto number = reader.number(option, range)) reflection.SetDouble(holder, field, *number);
  } else if (const auto whole = reader.integer(option, std::uint64_t(range.low), std::uint64_t(range.high))) {
    if (field->cpp_type() == Field::CPPTYPE_INT32) {
      reflection.SetInt32(holder, field, std::int32_t(*whole));
    } else {
      reflection.SetUInt32(holder, field, std::uint32_t(*whole));
    }
  }
}

void add_fields(CLI::App& app, SettingsOptions& options, bool any_picture) {
  pb::RenderSettings message;
  for (const FieldOption& field : kFieldOptions) {
    if (field.any_picture != any_picture) continue;
    const auto* type = place_of(message, field.path).field->enum_type();
    const auto* row = find_field(field.path, {});
    const std::string allowed = type ? join(short_names(*type), ", ") : row->range.to_string();
    add_text(app, options.fields[field.path], field.flag, field.value, fmt::format(fmt::runtime(field.help), allowed));
  }
}

// Channels beside radiance: the protocol's TileFormat has a switch of that name for each.
std::vector<std::string> layer_names() {
  std::vector<std::string> names;
  const google::protobuf::Descriptor& type = *pb::TileFormat::descriptor();
  for (int i = 0; i < type.field_count(); ++i) {
    const google::protobuf::FieldDescriptor& field = *type.field(i);
    if (field.type() == google::protobuf::FieldDescriptor::TYPE_BOOL && field.name().rfind("without_", 0) != 0)
      names.push_back(field.name());
  }
  return names;
}

}  // namespace

void add_picture_options(CLI::App& app, SettingsOptions& options) {
  add_text(app, options.size, "--size", "WxH",
           "Picture size in pixels. Default: what the scene file asks for, else 720 rows at the camera's aspect, else "
           "1280x720");
  add_text(app, options.camera, "--camera", "NAME",
           "Camera of the scene, by name or number from 0. Default: the first");
  add_text(app, options.seed, "--seed", "N", "Same seed, same bits; [0, 2^64). Default: 0");
  add_fields(app, options, true);
  add_text(app, options.filter, "--filter", "FILTER[:R]",
           "Reconstruction filter of a pixel: " + join(short_names(*pb::PixelFilter_descriptor()), ", ") +
               ". R in pixels, " + find_field("filter_scale", {})->range.to_string() +
               ": the tent's radius, default 1; the Gaussian's standard deviation, default 0.5. "
               "Default: the scene file's, else box");
  add_text(app, options.device, "--device", "DEVICE",
           std::string("What traces the paths: ") + kRenderDevices +
               ". Vulkan devices have --mode pt with --integrator path; heliograph info lists them. Default: cpu");
  add_text(app, options.region, "--region", "x0,y0,x1,y1",
           "Renders only these pixels, x0 <= x < x1 and y0 <= y < y1. Default: the whole picture");
}

void add_settings_options(CLI::App& app, SettingsOptions& options) {
  add_picture_options(app, options);
  add_fields(app, options, false);
  add_text(
      app, options.technique, "--technique", "S,T",
      "Renders only paths of S light and T camera vertices (S + T - 1 segments), by their weight among all "
      "techniques (--integrator bdpt). S 0: lights that are met; S 1: light samples; T 1: light paths joined to the "
      "camera. Default: all together");
}

namespace {

// Parses S,T; the validator checks their ranges, which depend on the longest path.
void read_technique(const SettingsOptions& options, pb::RenderSettings& settings, OptionReader& reader) {
  if (!options.technique.given()) return;
  const std::string& text = options.technique.text;
  const char *first = text.data(), *last = first + text.size();
  std::int32_t s = 0, t = 0;
  const auto light = std::from_chars(first, last, s);
  const bool comma = light.ec == std::errc() && light.ptr != last && *light.ptr == ',';
  const auto camera = std::from_chars(comma ? light.ptr + 1 : last, last, t);
  if (!comma || camera.ec != std::errc() || camera.ptr != last) {
    reader.problem(options.technique, "'" + text + "' is not S,T, two whole numbers with a comma");
    return;
  }
  settings.mutable_technique()->set_light_vertices(s);
  settings.mutable_technique()->set_camera_vertices(t);
}

void read_filter(const SettingsOptions& options, pb::RenderSettings& settings, OptionReader& reader) {
  if (!options.filter.given()) return;
  const std::string& text = options.filter.text;
  const std::size_t colon = text.find(':');
  const auto kind = from_short_name<pb::PixelFilter>(text.substr(0, colon));
  if (!kind) {
    reader.problem(options.filter, "'" + text + "' is none of " +
                                       join(short_names(*pb::PixelFilter_descriptor()), ", ") +
                                       ", with :R behind tent or gaussian");
    return;
  }
  settings.set_filter(*kind);
  if (colon == std::string::npos) return;
  if (*kind == pb::PIXEL_FILTER_BOX) {
    reader.problem(options.filter, "'" + text + "': the box has no R; allowed: box");
    return;
  }
  double scale = 0;
  const char *first = text.data() + colon + 1, *last = text.data() + text.size();
  const auto [end, error] = std::from_chars(first, last, scale);
  const NumberRange& range = find_field("filter_scale", {})->range;
  if (error != std::errc() || end != last || !range.contains(scale)) {
    reader.problem(options.filter, fmt::format("'{}': R is not a number in {}", text, range.to_string()));
    return;
  }
  settings.set_filter_scale(scale);
}

// The option that says what is at a path ("technique.light_vertices", "width x height"); null: none.
const TextOption* option_of(const std::string& path, const SettingsOptions& options) {
  if (path.starts_with("width") || path == "height") return &options.size;
  if (path.starts_with("technique")) return &options.technique;
  if (path.starts_with("filter")) return &options.filter;
  if (path == "region") return &options.region;
  if (path == "device") return &options.device;
  const auto found = options.fields.find(path);
  return found == options.fields.end() ? nullptr : &found->second;
}

// Asks the validator. What the scene decides if nobody else does is taken as large as may be.
void check_settings(const SettingsOptions& options, pb::RenderSettings settings, const RenderLimits& limits,
                    OptionReader& reader) {
  RenderLimits film = limits;
  if (settings.width() == 0 || settings.height() == 0) {
    film = {std::numeric_limits<int>::max(), std::numeric_limits<std::uint64_t>::max()};
    settings.set_width(film.max_film_side);
    settings.set_height(film.max_film_side);
  }
  if (settings.max_segments() == 0) settings.set_max_segments(kMostJoinedSegments);
  Problems found;
  const RenderSettings values = helio::read_settings(settings, film, "", found);
  if (found.empty()) {
    const Status fits = check_film_size(values, film, "");
    if (!fits) found.add(fits.error().where, fits.error().message);
  }
  for (const Problems::Item& item : found.items()) {
    const TextOption* option = option_of(item.where, options);
    if (!option || !option->given()) {
      reader.problems().add("settings." + item.where, item.message);
    } else if (item.where == "width" || item.where == "height" || item.where.starts_with("technique.")) {
      reader.problem(*option, item.where.substr(item.where.find('.') + 1) + " " + item.message);
    } else {
      reader.problem(*option, item.message);
    }
  }
}

RenderLimits limits_of(const pb::GetServerInfoResponse& server) {
  RenderLimits limits{std::numeric_limits<int>::max(), std::numeric_limits<std::uint64_t>::max()};
  if (server.limits().max_film_side() > 0) limits.max_film_side = server.limits().max_film_side();
  if (server.limits().max_film_pixels() > 0) limits.max_film_pixels = server.limits().max_film_pixels();
  return limits;
}

}  // namespace

pb::RenderSettings read_settings(const SettingsOptions& options, OptionReader& reader, pb::Mode mode) {
  const std::size_t before = reader.problems().size();
  pb::RenderSettings settings;
  settings.set_mode(mode);
  if (const auto size = reader.size(options.size)) {
    settings.set_width(size->first);
    settings.set_height(size->second);
  }
  read_filter(options, settings, reader);
  for (const FieldOption& field : kFieldOptions) {
    const auto found = options.fields.find(field.path);
    if (found == options.fields.end() || !found->second.given()) continue;
    TextOption option = found->second;
    if (option.text == "pt-bdpt") option.text = "pt+bdpt";  // as it was once spelled
    Problems ignored;
    const RenderSettings chosen = helio::read_settings(settings, {}, "", ignored);
    const auto* row = find_field(field.path, chosen);
    read_field(field.path, option, row ? row->range : NumberRange(), settings, reader);
    if (row && !row->use.holds(chosen)) reader.problem(option, std::string("is only valid with --") + row->use.words);
  }
  reader.text(options.camera);
  if (const auto device = reader.text(options.device)) settings.set_device(*device);
  settings.set_seed(reader.integer(options.seed, 0, std::numeric_limits<std::uint64_t>::max()).value_or(0));
  read_technique(options, settings, reader);
  if (const auto rect = reader.rect(options.region)) write_rect(*rect, *settings.mutable_region());
  if (reader.problems().size() == before) check_settings(options, settings, limits_of({}), reader);
  return settings;
}

bool asks_for_device(const pb::RenderSettings& settings) {
  return !settings.device().empty() && settings.device() != "cpu";
}

// `offered`: the daemon's own; empty: it does not say.
template <class Enum>
static void check_offered(const char* path, Enum wanted, const google::protobuf::RepeatedField<int>& offered,
                          const SettingsOptions& options, OptionReader& reader) {
  if (wanted == Enum() || offered.empty()) return;
  if (std::find(offered.begin(), offered.end(), int(wanted)) != offered.end()) return;
  std::vector<std::string> known;
  for (const int value : offered) known.push_back(to_short_name(static_cast<Enum>(value)));
  const std::string problem = "'" + to_short_name(wanted) + "' is none of the daemon's: " + join(known, ", ");
  const TextOption* option = option_of(path, options);
  if (option && option->given()) {
    reader.problem(*option, problem);
  } else {
    reader.problems().add(path, problem);
  }
}

void check_against_server(const SettingsOptions& options, const pb::RenderSettings& settings,
                          const pb::GetServerInfoResponse& server, OptionReader& reader) {
  check_settings(options, settings, limits_of(server), reader);
  check_offered("mode", settings.mode(), server.modes(), options, reader);
  // A daemon that names none is older than the choice.
  google::protobuf::RepeatedField<int> integrators = server.integrators();
  if (integrators.empty()) integrators.Add(pb::INTEGRATOR_PATH);
  check_offered("integrator", settings.integrator(), integrators, options, reader);
}

const pb::SceneCamera* choose_camera(const SettingsOptions& options, const pb::SceneInfo& scene, OptionReader& reader) {
  if (scene.cameras().empty()) {
    reader.problems().add("FILE", "the server reports no camera");
    return nullptr;
  }
  if (!options.camera.given()) return &scene.cameras(0);
  const std::vector<pb::SceneCamera> cameras = cameras_of(scene);
  const pb::SceneCamera* found = find_camera(cameras, options.camera.text);
  if (found) return &scene.cameras(static_cast<int>(found - cameras.data()));
  reader.problem(options.camera, fmt::format("'{}' is none of {} and no number in [0, {}]", options.camera.text,
                                             camera_names(cameras), cameras.size() - 1));
  return nullptr;
}

void set_defaults(pb::RenderSettings& settings, const pb::SceneInfo& scene, const pb::SceneCamera& camera) {
  const bool joins =
      settings.integrator() != pb::INTEGRATOR_UNSPECIFIED && settings.integrator() != pb::INTEGRATOR_PATH;
  const int longest = joins ? std::min(scene.max_segments(), kMostJoinedSegments) : scene.max_segments();
  if (settings.max_segments() == 0) settings.set_max_segments(longest);
  if (settings.roulette_from() == 0) settings.set_roulette_from(scene.roulette_from());
  if (settings.filter() == pb::PIXEL_FILTER_UNSPECIFIED) {
    settings.set_filter(camera.filter());
    settings.set_filter_scale(camera.filter_scale());
  }
  if (settings.width() > 0) return;
  if (camera.width() > 0 && camera.height() > 0) {
    settings.set_width(camera.width());
    settings.set_height(camera.height());
    if (camera.has_crop() && !settings.has_region()) *settings.mutable_region() = camera.crop();
    return;
  }
  settings.set_width(kDefaultWidth);
  settings.set_height(kDefaultHeight);
  // Beyond 8:1 an aspect is more likely a mistake in the file than a wish.
  if (camera.aspect() >= 0.125 && camera.aspect() <= 8) {
    settings.set_width(static_cast<int>(std::lround(kDefaultHeight * camera.aspect())));
  }
}

void add_budget_options(CLI::App& app, BudgetOptions& options, const std::string& of_what, bool paced) {
  add_text(app, options.fields["samples"], "--samples", "N",
           "Ends " + of_what + " at N samples per pixel, " + kSampleBudget.to_string() +
               ". Default when no budget is given: 64");
  add_text(app, options.fields["time_s"], "--time", "SECONDS", "Ends " + of_what + " after this wall time, > 0");
  add_text(app, options.fields["error"], "--error", "E",
           "Ends " + of_what + " when the estimated error has come down to E, > 0, in radiance units");
  if (!paced) return;
  add_text(app, options.fields["bytes_per_second"], "--bytes-per-second", "R",
           "Paces the tiles that are sent on the way, > 0; ends nothing. Default: unlimited");
}

pb::Budget read_budget(const BudgetOptions& options, OptionReader& reader) {
  pb::Budget budget;
  for (const SettingField<Budget>& field : budget_fields()) {
    const auto option = options.fields.find(field.path);
    if (option != options.fields.end()) read_field(field.path, option->second, field.range, budget, reader);
  }
  if (budget.samples() == 0 && budget.time_s() == 0 && budget.error() == 0) budget.set_samples(kDefaultSamples);
  return budget;
}

namespace {

void add_format_options(CLI::App& app, TransportOptions& options, const std::string& of_what,
                        const std::string& default_compression) {
  add_text(app, options.compression, "--compression", "KIND",
           "Of " + of_what + ": " + join(short_names(*pb::Compression_descriptor()), ", ") +
               " (dwaa loses detail). Default: " + default_compression);
  add_text(app, options.pixel_type, "--pixel-type", "TYPE",
           "Of " + of_what + ": float, or half for half the bytes. Default: float");
  add_text(app, options.layers, "--layers", "LIST",
           "Further layers of the picture, comma-separated: alpha (A), depth (Z), normal (N.x, N.y, N.z), albedo "
           "(albedo.r, albedo.g, albedo.b), history (history.weight, bias.bound, history.age: what earlier pictures "
           "brought), density (samples.density: samples over their mean), display (display.R, display.G, display.B: "
           "filtered for the eye, and display.error: its error by estimate)");
}

}  // namespace

void add_transport_options(CLI::App& app, TransportOptions& options) {
  add_format_options(app, options, "the tiles on their way", "none in process and on loopback, zip otherwise");
}

void add_kept_file_options(CLI::App& app, TransportOptions& options) {
  add_format_options(app, options, "the picture's file", "zip");
}

pb::TileFormat read_kept_file(const TransportOptions& options, OptionReader& reader) {
  pb::TileFormat format = read_transport(options, {}, reader);
  if (!options.compression.given()) format.set_compression(pb::COMPRESSION_ZIP);
  return format;
}

pb::TileFormat read_transport(const TransportOptions& options, const std::string& address, OptionReader& reader) {
  pb::TileFormat format;
  const bool near = address.empty() || is_loopback(address);
  format.set_compression(near ? pb::COMPRESSION_NONE : pb::COMPRESSION_ZIP);
  format.set_pixel_type(pb::PIXEL_TYPE_FLOAT);
  if (const auto name = reader.choice(options.compression, short_names(*pb::Compression_descriptor()))) {
    format.set_compression(from_short_name<pb::Compression>(*name).value());
  }
  if (const auto name = reader.choice(options.pixel_type, short_names(*pb::PixelType_descriptor()))) {
    format.set_pixel_type(from_short_name<pb::PixelType>(*name).value());
  }
  for (const std::string& layer : reader.choices(options.layers, layer_names())) {
    format.GetReflection()->SetBool(&format, format.GetDescriptor()->FindFieldByName(layer), true);
  }
  return format;
}

}  // namespace helio::cli
