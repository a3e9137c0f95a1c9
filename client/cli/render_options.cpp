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

namespace helio::cli {

namespace {

constexpr std::uint32_t kDefaultSamples = 64;
constexpr int kDefaultWidth = 1280, kDefaultHeight = 720;
constexpr std::uint64_t kMaxSegments = 65535;      // the protocol's range
constexpr std::int32_t kMostJoinedVertices = 257;  // likewise: 256 segments
constexpr double kMaxFilterScale = 16;             // likewise
constexpr double kMostReuseError = 1e6;            // likewise
constexpr double kHuge = std::numeric_limits<double>::max();

// What pictures can have besides: the protocol's TileFormat has a switch of that name for each.
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
  add_text(app, options.roulette_from, "--roulette-from", "VERTEX",
           "First vertex at which Russian roulette may end a path, [1, 65535]. Default: the scene file's, else 3");
  add_text(app, options.filter, "--filter", "FILTER[:R]",
           "Reconstruction filter of a pixel: " + join(short_names(*pb::PixelFilter_descriptor()), ", ") +
               ". R in pixels, (0, 16]: the tent's radius, default 1; the Gaussian's standard deviation, default 0.5. "
               "Default: the scene file's, else box");
  add_text(app, options.region, "--region", "x0,y0,x1,y1",
           "Renders only these pixels, x0 <= x < x1 and y0 <= y < y1. Default: the whole picture");
}

void add_settings_options(CLI::App& app, SettingsOptions& options) {
  add_picture_options(app, options);
  add_text(app, options.mode, "--mode", "MODE",
           "How to render: " + join(short_names(*pb::Mode_descriptor()), ", ") +
               ". adaptive sends samples where noise and cost ask for them; reproject carries what is still true of a "
               "view into the next one; combined does both. Default: pt, path tracing");
  add_text(
      app, options.integrator, "--integrator", "INTEGRATOR",
      "Which paths make the picture: path, from the camera; light, from the lights alone, which shows nothing that "
      "mirrors and glass show; bdpt, from both, with all connections; pt+bdpt, path or bdpt in every part of the "
      "picture, whichever pays there: with --variant bounded of --mode, light with pt and adaptive alone. lvc, "
      "bdpt with light vertices that all of the picture shares; vcm, lvc and merging of light paths that arrive "
      "nearby; "
      "photon, merging alone: --mode pt. The last two are biased, less so with every sample. Default: path");
  add_text(app, options.connections, "--connections", "N",
           "Of --integrator lvc and vcm: of every camera vertex to light vertices, [1, 64]. Default: 2");
  add_text(
      app, options.merging_radius, "--merging-radius", "R",
      "Of --integrator vcm and photon: within which the first samples merge light paths, as a share of the scene's "
      "radius, [1e-6, 0.1]. Default: 0.003");
  add_text(app, options.merging_shrinking, "--merging-shrinking", "A",
           "Of --integrator vcm and photon: the radius falls as n^((A - 1) / 2) over samples, [0.1, 1]. Default: 0.75");
  add_text(app, options.technique, "--technique", "S,T[,unweighted]",
           "Of --integrator bdpt: shows only paths of S light and T camera vertices (S + T - 1 segments), by their "
           "weight among all techniques, or unweighted, as this one alone has them. S 0: lights that are met; S 1: "
           "light samples; T 1: light paths joined to the camera. Default: all together");
  add_text(app, options.variant, "--variant", "VARIANT",
           "Of every --mode but pt: bounded, or paper for the published method, which is biased and knows no bound. "
           "Default: bounded");
  add_text(
      app, options.adaptive_min, "--adaptive-min", "N",
      "Of --mode adaptive and combined: samples that every pixel gets before counts differ, even, [4, 65536]; paper: "
      "[2, 65536]. A picture that much was carried into needs none. Default: 16, paper 4");
  add_text(app, options.adaptive_max, "--adaptive-max", "N",
           "Of --variant paper: iterations until its threshold is 0, (--adaptive-min, 2^20]. Default: 32");
  add_text(app, options.adaptive_measure, "--adaptive-measure", "MEASURE",
           "Of --mode adaptive and combined: the error that the counts make small, rmse or relmse. Default: relmse");
  add_text(app, options.stored_hits, "--stored-hits", "N",
           "Of --variant paper with --mode reproject and combined: first hits kept per pixel, 1 or 4. Default: 4");
  add_text(app, options.max_error, "--max-reuse-error", "E",
           "Of --variant paper with --mode reproject and combined: largest change of a pixel, radiance, (0, 1e6]. "
           "Default: 1/256");
  add_text(app, options.max_segments, "--max-segments", "N",
           "Longest path, in segments with the camera's counted, [1, 65535]. Default: the scene file's, else 10");
}

namespace {

void read_adaptive(const SettingsOptions& options, pb::RenderSettings& settings, OptionReader& reader) {
  const bool allocates = settings.mode() == pb::MODE_ADAPTIVE || settings.mode() == pb::MODE_COMBINED;
  for (const TextOption* option : {&options.adaptive_min, &options.adaptive_max, &options.adaptive_measure}) {
    if (option->given() && !allocates) reader.problem(*option, "stands only beside --mode adaptive or combined");
  }
  if (options.variant.given() && !allocates && settings.mode() != pb::MODE_REPROJECT)
    reader.problem(options.variant, "stands only beside --mode adaptive, reproject or combined");
  if (const auto variant = reader.choice(options.variant, short_names(*pb::Variant_descriptor())))
    settings.set_variant(from_short_name<pb::Variant>(*variant).value());
  const bool paper = settings.variant() == pb::VARIANT_PAPER;
  if (options.adaptive_max.given() && allocates && !paper)
    reader.problem(options.adaptive_max, "stands only beside --variant paper");
  if (const auto n = reader.integer(options.adaptive_min, paper ? 2 : 4, 65536)) {
    if (*n % 2 != 0) reader.problem(options.adaptive_min, "is odd; each of two halves gets the same number of samples");
    settings.mutable_adaptive()->set_min_samples(static_cast<std::uint32_t>(*n));
  }
  if (const auto n = reader.integer(options.adaptive_max, 3, 1u << 20)) {
    const std::uint32_t least = settings.adaptive().min_samples();
    if (*n <= least) reader.problem(options.adaptive_max, fmt::format("must be more than --adaptive-min, {}", least));
    settings.mutable_adaptive()->set_max_samples(static_cast<std::uint32_t>(*n));
  }
  if (const auto measure = reader.choice(options.adaptive_measure, short_names(*pb::ErrorMeasure_descriptor())))
    settings.mutable_adaptive()->set_measure(from_short_name<pb::ErrorMeasure>(*measure).value());
}

bool caches_light_vertices(pb::Integrator integrator) {
  return integrator == pb::INTEGRATOR_LVC || integrator == pb::INTEGRATOR_VCM || integrator == pb::INTEGRATOR_PHOTON;
}

void read_light_cache(const SettingsOptions& options, pb::RenderSettings& settings, OptionReader& reader) {
  const bool joins = caches_light_vertices(settings.integrator()) && settings.integrator() != pb::INTEGRATOR_PHOTON;
  const bool merges = caches_light_vertices(settings.integrator()) && settings.integrator() != pb::INTEGRATOR_LVC;
  if (options.connections.given() && !joins)
    reader.problem(options.connections, "stands only beside --integrator lvc or vcm");
  for (const TextOption* option : {&options.merging_radius, &options.merging_shrinking}) {
    if (option->given() && !merges) reader.problem(*option, "stands only beside --integrator vcm or photon");
  }
  if (const auto n = reader.integer(options.connections, 1, 64))
    settings.mutable_light_cache()->set_connections(static_cast<std::uint32_t>(*n));
  if (const auto radius = reader.number(options.merging_radius, 1e-6, true, 0.1))
    settings.mutable_light_cache()->set_radius(*radius);
  if (const auto shrinking = reader.number(options.merging_shrinking, 0.1, true, 1))
    settings.mutable_light_cache()->set_shrinking(*shrinking);
}

void read_integrator(const SettingsOptions& options, pb::RenderSettings& settings, OptionReader& reader) {
  auto integrator = options.integrator;
  if (integrator.text == "pt-bdpt") integrator.text = "pt+bdpt";  // as it was once spelled
  const auto name = reader.choice(integrator, short_names(*pb::Integrator_descriptor()));
  if (!name) return;
  settings.set_integrator(from_short_name<pb::Integrator>(*name).value());
  const bool pt = settings.mode() == pb::MODE_UNSPECIFIED || settings.mode() == pb::MODE_PT;
  if (caches_light_vertices(settings.integrator())) {
    if (!pt) reader.problem(options.integrator, "'" + *name + "' stands only beside --mode pt");
    return;
  }
  const bool light = settings.integrator() == pb::INTEGRATOR_LIGHT;
  const bool bounded = settings.variant() != pb::VARIANT_PAPER && (settings.mode() == pb::MODE_ADAPTIVE || !light);
  if (settings.integrator() != pb::INTEGRATOR_PATH && !pt && !bounded)
    reader.problem(options.integrator, "'" + *name + "' stands only beside --mode pt, or " +
                                           (light ? "adaptive" : "another") + " with --variant bounded");
}

void read_technique(const SettingsOptions& options, pb::RenderSettings& settings, OptionReader& reader) {
  if (!options.technique.given()) return;
  const std::string& text = options.technique.text;
  std::int32_t numbers[2] = {0, 0};
  const char *at = text.data(), *last = at + text.size();
  bool good = true;
  for (std::int32_t& number : numbers) {
    const auto [end, error] = std::from_chars(at, last, number);
    good = good && error == std::errc() && number >= 0 && number <= kMostJoinedVertices;
    at = end;
    if (&number == numbers) good = good && at != last && *at++ == ',';
    if (!good) break;
  }
  const std::string_view rest(at, std::size_t(last - at));
  if (!good || !(rest.empty() || rest == ",unweighted")) {
    reader.problem(options.technique, fmt::format("'{}' is not S,T or S,T,unweighted with whole numbers in [0, {}]",
                                                  text, kMostJoinedVertices));
    return;
  }
  const auto [s, t] = numbers;
  const int most = settings.max_segments();  // 0: the scene's
  if (s == 1 && t == 1) {
    reader.problem(options.technique, "'" + text + "': lights seen directly come from 0,2");
  } else if (t < 1 || s + t < 2) {
    reader.problem(options.technique, "'" + text + "' is no path; allowed: T at least 1, 2 where S is 0 or 1");
  } else if (most > 0 && s + t - 1 > most) {
    reader.problem(options.technique, fmt::format("'{}' is {} segments; --max-segments is {}", text, s + t - 1, most));
  }
  const bool pt = settings.mode() == pb::MODE_UNSPECIFIED || settings.mode() == pb::MODE_PT;
  if (settings.integrator() != pb::INTEGRATOR_BDPT || !pt)
    reader.problem(options.technique, "stands only beside --integrator bdpt with --mode pt");
  settings.mutable_technique()->set_light_vertices(s);
  settings.mutable_technique()->set_camera_vertices(t);
  settings.mutable_technique()->set_unweighted(!rest.empty());
}

void read_reprojection(const SettingsOptions& options, pb::RenderSettings& settings, OptionReader& reader) {
  const bool reuses = settings.mode() == pb::MODE_REPROJECT || settings.mode() == pb::MODE_COMBINED;
  for (const TextOption* option : {&options.stored_hits, &options.max_error}) {
    if (option->given() && !(reuses && settings.variant() == pb::VARIANT_PAPER))
      reader.problem(*option, "stands only beside --mode reproject or combined with --variant paper");
  }
  if (const auto n = reader.integer(options.stored_hits, 1, 4)) {
    if (*n != 1 && *n != 4) reader.problem(options.stored_hits, fmt::format("'{}' is none of 1, 4", *n));
    settings.mutable_reprojection()->set_stored_hits(static_cast<std::uint32_t>(*n));
  }
  if (const auto error = reader.number(options.max_error, 0, false, kMostReuseError))
    settings.mutable_reprojection()->set_max_error(*error);
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
  if (error != std::errc() || end != last || !(scale > 0 && scale <= kMaxFilterScale)) {
    reader.problem(options.filter, fmt::format("'{}': R is not a number in (0, {}]", text, kMaxFilterScale));
    return;
  }
  settings.set_filter_scale(scale);
}

}  // namespace

pb::RenderSettings read_settings(const SettingsOptions& options, OptionReader& reader) {
  pb::RenderSettings settings;
  if (const auto size = reader.size(options.size)) {
    settings.set_width(size->first);
    settings.set_height(size->second);
  }
  if (const auto mode = reader.choice(options.mode, short_names(*pb::Mode_descriptor()))) {
    settings.set_mode(from_short_name<pb::Mode>(*mode).value());
  }
  read_adaptive(options, settings, reader);
  read_integrator(options, settings, reader);
  read_light_cache(options, settings, reader);
  read_reprojection(options, settings, reader);
  reader.text(options.camera);
  settings.set_seed(reader.integer(options.seed, 0, std::numeric_limits<std::uint64_t>::max()).value_or(0));
  settings.set_max_segments(static_cast<int>(reader.integer(options.max_segments, 1, kMaxSegments).value_or(0)));
  settings.set_roulette_from(static_cast<int>(reader.integer(options.roulette_from, 1, kMaxSegments).value_or(0)));
  read_technique(options, settings, reader);
  read_filter(options, settings, reader);
  if (const auto rect = reader.rect(options.region)) {
    pb::Rect& region = *settings.mutable_region();
    region.set_x0(rect->x0);
    region.set_y0(rect->y0);
    region.set_x1(rect->x1);
    region.set_y1(rect->y1);
  }
  if (settings.width() > 0) check_region(options, settings, reader);
  return settings;
}

// `offered`: the daemon's own; empty: it does not say.
template <class Enum>
static void check_offered(const TextOption& option, Enum wanted, const google::protobuf::RepeatedField<int>& offered,
                          OptionReader& reader) {
  if (wanted == Enum() || offered.empty()) return;
  if (std::find(offered.begin(), offered.end(), int(wanted)) != offered.end()) return;
  std::vector<std::string> known;
  for (const int value : offered) known.push_back(to_short_name(static_cast<Enum>(value)));
  reader.problem(option, "'" + option.text + "' is none of the daemon's: " + join(known, ", "));
}

void check_against_server(const SettingsOptions& options, const pb::RenderSettings& settings,
                          const pb::GetServerInfoResponse& server, OptionReader& reader) {
  const std::int64_t side = server.limits().max_film_side();
  const std::uint64_t pixels = std::uint64_t(settings.width()) * std::uint64_t(settings.height());
  if (side > 0 && std::max(settings.width(), settings.height()) > side) {
    reader.problem(options.size, fmt::format("'{}': width and height must lie in [1, {}]", options.size.text, side));
  } else if (server.limits().max_film_pixels() > 0 && pixels > server.limits().max_film_pixels()) {
    reader.problem(options.size, fmt::format("'{}' is {} pixels, more than the allowed {}", options.size.text, pixels,
                                             server.limits().max_film_pixels()));
  }
  check_offered(options.mode, settings.mode(), server.modes(), reader);
  // A daemon that names none is older than the choice.
  const bool older = server.integrators().empty() && settings.integrator() != pb::INTEGRATOR_PATH;
  if (older && settings.integrator() != pb::INTEGRATOR_UNSPECIFIED)
    reader.problem(options.integrator, "'" + options.integrator.text + "' is none of the daemon's: path");
  check_offered(options.integrator, settings.integrator(), server.integrators(), reader);
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
  const int longest = joins ? std::min(scene.max_segments(), kMostJoinedVertices - 1) : scene.max_segments();
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

void check_region(const SettingsOptions& options, const pb::RenderSettings& settings, OptionReader& reader) {
  if (!settings.has_region()) return;
  if (settings.region().x1() > settings.width() || settings.region().y1() > settings.height()) {
    reader.problem(options.region, fmt::format("'{}' leaves the picture of {}x{} pixels", options.region.text,
                                               settings.width(), settings.height()));
  }
}

void add_budget_options(CLI::App& app, BudgetOptions& options, const std::string& of_what) {
  add_text(app, options.samples, "--samples", "N",
           "Ends " + of_what + " at N samples per pixel, [1, 2^30]. Default when no budget is given: 64");
  add_text(app, options.time, "--time", "SECONDS", "Ends " + of_what + " after this wall time, > 0");
  add_text(app, options.error, "--error", "E",
           "Ends " + of_what +
               " when the estimated error has come down to E, > 0, in radiance units unless "
               "--error-measure says otherwise");
  add_text(app, options.error_measure, "--error-measure", "MEASURE",
           "What --error counts: rmse (standard error of the picture in radiance units) or relmse (mean of variance / "
           "(mean^2 + 0.01 (image mean)^2)). Default: rmse");
  add_text(app, options.bytes_per_second, "--bytes-per-second", "R",
           "Paces the tiles that are sent on the way, > 0; ends nothing. Default: unlimited");
}

pb::Budget read_budget(const BudgetOptions& options, OptionReader& reader) {
  pb::Budget budget;
  if (const auto samples = reader.integer(options.samples, 1, 1u << 30)) {
    budget.set_samples(static_cast<std::uint32_t>(*samples));
  }
  if (const auto time = reader.number(options.time, 0, false, kHuge)) budget.set_time_s(*time);
  if (const auto error = reader.number(options.error, 0, false, kHuge)) budget.set_error(*error);
  if (const auto rate = reader.number(options.bytes_per_second, 0, false, kHuge)) budget.set_bytes_per_second(*rate);
  if (const auto measure = reader.choice(options.error_measure, short_names(*pb::ErrorMeasure_descriptor()))) {
    budget.set_error_measure(from_short_name<pb::ErrorMeasure>(*measure).value());
    if (!options.error.given()) reader.problem(options.error_measure, "stands only beside --error");
  }
  if (!options.samples.given() && !options.time.given() && !options.error.given()) budget.set_samples(kDefaultSamples);
  return budget;
}

void add_transport_options(CLI::App& app, TransportOptions& options) {
  add_text(app, options.compression, "--compression", "KIND",
           "Of the tiles on their way: " + join(short_names(*pb::Compression_descriptor()), ", ") +
               " (dwaa loses detail). Default: none in process and on loopback, zip otherwise");
  add_text(app, options.pixel_type, "--pixel-type", "TYPE",
           "Of the tiles on their way: float, or half for half the bytes. Default: float");
  add_text(app, options.layers, "--layers", "LIST",
           "Further layers of the picture, comma-separated: alpha (A), depth (Z), normal (N.x, N.y, N.z), albedo "
           "(albedo.r, albedo.g, albedo.b), history (history.weight, bias.bound, history.age: what earlier pictures "
           "brought), density (samples.density: samples over their mean)");
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
