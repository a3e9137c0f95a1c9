#include "server/compare/comparison_request.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "renderer/base/hash.h"
#include "server/base/read_enum.h"
#include "server/stream/convert.h"
#include "server/stream/settings_messages.h"

namespace helio {
namespace {

constexpr int kMaxModes = 64, kMaxViews = 1000, kMaxBudgets = 64, kMaxRegions = 16;
constexpr std::uint32_t kMaxSeeds = 1000, kMaxWorstPixels = 64;
constexpr std::size_t kMaxName = 64;
// Bytes that a unit has in a message without its mode's name and values, and a value of the whole picture, at most; how
// many values a region has (picture_errors.h); and what is left of a message of 4 MiB for units.
constexpr std::uint64_t kUnitBytes = 96, kValueBytes = 13, kRegionValues = 9, kMostBytes = 3500u << 10;
constexpr std::uint64_t kReferenceErrorBytes = 9;  // of bias, beside its value
constexpr double kLeastTime = 1e-3, kMostTime = 86400;

bool good_name(std::string_view name) {
  const auto letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  return !name.empty() && name.size() <= kMaxName && letter(name.front()) &&
         std::all_of(name.begin(), name.end(),
                     [&](char c) { return letter(c) || std::string_view("._+-").find(c) != std::string_view::npos; });
}

std::uint64_t name_key(std::string_view name) {
  std::uint64_t key = kFnv1aStart;
  for (const char c : name) key = fnv1a(key, static_cast<unsigned char>(c));
  return key;
}

ComparedMode read_mode(const pb::CompareMode& message, const ComparisonLimits& limits, bool path,
                       const std::string& where, Problems& problems) {
  ComparedMode mode;
  mode.name = message.name();
  if (!good_name(mode.name)) {
    problems.add(where + ".name",
                 fmt::format("'{}'; allowed: 1 to {} of A-Z, a-z, 0-9, '.', '_', '+', '-', the first a "
                             "letter or digit",
                             mode.name.substr(0, kMaxName), kMaxName));
  }
  mode.settings = read_settings(message.settings(), limits.film, where + ".settings", problems);
  if (mode.settings.region)
    problems.add(where + ".settings.region", "is given; allowed: none, whole pictures are compared");
  switch (read_enum(*pb::ComparedPicture_descriptor(), message.picture(), pb::COMPARED_PICTURE_FILM, where + ".picture",
                    problems)) {
    case pb::COMPARED_PICTURE_DISPLAY:
      mode.picture = ComparedMode::Picture::display;
      break;
    case pb::COMPARED_PICTURE_PREVIEW:
      mode.picture = ComparedMode::Picture::preview;
      break;
    default:
      break;
  }
  const auto denoiser = read_enum(*pb::Denoiser_descriptor(), message.denoiser(), pb::DENOISER_UNSPECIFIED,
                                  where + ".denoiser", problems);
  mode.oidn = denoiser == pb::DENOISER_OIDN;
  if (mode.oidn && mode.picture != ComparedMode::Picture::display) {
    problems.add(where + ".denoiser", "is given without picture DISPLAY; allowed: none");
  } else if (mode.oidn && !limits.has_oidn) {
    problems.add(where + ".denoiser", "OIDN; this daemon was not given the library (oidn-library)");
  }
  const bool previews = mode.picture == ComparedMode::Picture::preview;
  if (previews && mode.settings.preview.rate <= 0)
    problems.add(where + ".settings.preview_rate", "0; allowed with picture PREVIEW: (0, 120]");
  if (!previews && mode.settings.preview.rate > 0)
    problems.add(where + ".settings.preview_rate", "is given without picture PREVIEW; allowed: 0");
  if (previews && !path) problems.add(where + ".picture", "PREVIEW of one view; allowed: with two views or more");
  return mode;
}

void check_like_first(const ComparedMode& first, const ComparedMode& mode, const std::string& where,
                      Problems& problems) {
  const RenderSettings &a = first.settings, &b = mode.settings;
  if (a.width != b.width || a.height != b.height) {
    problems.add(where + ".settings", fmt::format("width x height {} x {}; allowed: {} x {}, those of the first mode",
                                                  b.width, b.height, a.width, a.height));
  }
  if (!(a.filter == b.filter)) problems.add(where + ".settings.filter", "differs; allowed: the first mode's");
}

template <class Number>
void read_budgets(const google::protobuf::RepeatedField<Number>& given, double low, double high,
                  const std::string& where, std::vector<double>& budgets, Problems& problems) {
  if (given.size() > kMaxBudgets) {
    problems.add(where, fmt::format("{} budgets; allowed: at most {}", given.size(), kMaxBudgets));
    return;
  }
  for (int i = 0; i < given.size(); ++i) {
    const double budget = double(given[i]);
    const std::string place = fmt::format("{}[{}]", where, i);
    if (!(budget >= low && budget <= high))
      problems.add(place, fmt::format("{}; allowed: [{}, {}]", budget, low, high));
    if (!budgets.empty() && !(budget > budgets.back()))
      problems.add(place, fmt::format("{} behind {}; allowed: rising", budget, budgets.back()));
    budgets.push_back(budget);
  }
}

void read_reference(const pb::CompareReference& message, ComparisonRequest& request, const ComparisonLimits& limits,
                    std::size_t views, Problems& problems) {
  ReferenceRequest& reference = request.reference;
  if (message.has_loaded()) {
    const auto& ids = message.loaded().reference_ids();
    if (std::size_t(ids.size()) != views)
      problems.add("reference.loaded.reference_ids",
                   fmt::format("{}; allowed: {}, one for each view", ids.size(), views));
    for (int i = 0; i < ids.size(); ++i)
      check_id(ids[i], fmt::format("reference.loaded.reference_ids[{}]", i), problems);
    reference.loaded.assign(ids.begin(), ids.end());
    return;
  }
  const auto& rendered = message.rendered();
  if (!request.modes.empty()) reference.settings = request.modes.front().settings;
  if (rendered.has_settings()) {
    reference.settings = read_settings(rendered.settings(), limits.film, "reference.rendered.settings", problems);
    if (!request.modes.empty()) {
      ComparedMode as_mode;
      as_mode.settings = reference.settings;
      check_like_first(request.modes.front(), as_mode, "reference.rendered", problems);
    }
    if (reference.settings.region || reference.settings.preview.rate > 0)
      problems.add("reference.rendered.settings", "region or preview_rate is given; allowed: neither");
    if (reuses(reference.settings.mode))
      problems.add("reference.rendered.settings.mode", "carries samples of other views; allowed: PT, ADAPTIVE");
  } else {
    reference.settings.mode = RenderMode::pt;
    reference.settings.integrator = Integrator::path;
    reference.settings.variant = ModeVariant::bounded;
    reference.settings.technique.reset();
    reference.settings.preview = {};
    reference.settings.foveation = {};
  }
  if (rendered.error() != 0) reference.error = rendered.error();
  if (!(reference.error >= 1e-4 && reference.error <= 1))
    problems.add("reference.rendered.error", fmt::format("{}; allowed: [1e-4, 1], or 0", reference.error));
  if (rendered.max_samples() != 0) reference.max_samples = rendered.max_samples();
  if (reference.max_samples < 2 || reference.max_samples > (1u << 30) || reference.max_samples % 2 != 0)
    problems.add("reference.rendered.max_samples",
                 fmt::format("{}; allowed: even, [2, 2^30], or 0", reference.max_samples));
}

void read_disk(const pb::CompareRegion& given, ComparisonRequest& request, const std::string& where,
               Problems& problems) {
  if (given.has_rect()) problems.add(where + ".disk", "is given beside rect; allowed: one of them");
  const pb::CompareRegion::Disk& from = given.disk();
  const auto check = [&](const char* field, double value, const NumberRange& range) {
    if (range.contains(value)) return true;
    problems.add(where + ".disk." + field, number_text(value) + "; allowed: " + range.to_string());
    return false;
  };
  const NumberRange anywhere{-kMostGazePixels, kMostGazePixels};
  const bool x = check("x", from.x(), anywhere), y = check("y", from.y(), anywhere);
  const bool radius = check("radius", from.radius(), {0, kMostGazePixels, false});
  if (!x || !y || !radius || request.modes.empty()) return;
  MeasuredRegion region;
  region.name = given.name();
  region.disk = PixelDisk{from.x(), from.y(), from.radius(), from.outside()};
  if (request.width() < 1 || request.height() < 1) return;  // told with the settings
  if (!region.disk->has_pixels(request.width(), request.height()))
    problems.add(where + ".disk",
                 fmt::format("has no pixel of the picture; allowed: a part of {} x {}", request.width(), request.height()));
  request.errors.regions.push_back(std::move(region));
}

void read_regions(const pb::CompareRequest& message, ComparisonRequest& request, Problems& problems) {
  if (message.regions_size() > kMaxRegions)
    problems.add("regions", fmt::format("{}; allowed: at most {}", message.regions_size(), kMaxRegions));
  std::set<std::string> names{kDarkHalf};
  for (int i = 0; i < std::min(message.regions_size(), kMaxRegions); ++i) {
    const pb::CompareRegion& given = message.regions(i);
    const std::string where = fmt::format("regions[{}]", i);
    if (given.name().empty() || given.name().size() > kMaxName)
      problems.add(where + ".name", fmt::format("{} bytes; allowed: [1, {}]", given.name().size(), kMaxName));
    if (!names.insert(given.name()).second)
      problems.add(where + ".name", "'" + given.name() + "' is there twice; allowed: other names");
    if (given.has_disk()) {
      read_disk(given, request, where, problems);
      continue;
    }
    const PixelRect rect{given.rect().x0(), given.rect().y0(), given.rect().x1(), given.rect().y1()};
    const PixelRect whole{0, 0, request.modes.empty() ? 0 : request.width(),
                          request.modes.empty() ? 0 : request.height()};
    if (rect.empty() || !(intersect(rect, whole) == rect)) {
      problems.add(where + ".rect", fmt::format("[{}, {}) x [{}, {}); allowed: not empty, inside {} x {}", rect.x0,
                                                rect.x1, rect.y0, rect.y1, whole.x1, whole.y1));
    }
    request.errors.regions.push_back({given.name(), rect, std::nullopt});
  }
}

void read_measures(const pb::CompareRequest& message, ComparisonRequest& request, Problems& problems) {
  const bool path = request.path();
  if (message.measures_size() == 0) {
    request.flicker = path;
    request.told_rmse = true;
    return;
  }
  request.errors.measures = 0;
  for (int i = 0; i < message.measures_size(); ++i) {
    const int number = message.measures(i);
    const std::string where = fmt::format("measures[{}]", i);
    if (number < 1 || number > kMeasures) {
      problems.add(where, fmt::format("{}; allowed: [1, {}]", number, kMeasures));
      continue;
    }
    const Measure measure = Measure(number - 1);
    if (measure == Measure::flicker && !path) {
      problems.add(where, "FLICKER of one view; allowed: with two views or more");
    }
    if (measure == Measure::flicker) request.flicker = true;
    if (measure == Measure::told_rmse) request.told_rmse = true;
    request.errors.measures |= 1u << unsigned(measure);
  }
}

void read_done(const pb::CompareRequest& message, ComparisonRequest& request, Problems& problems) {
  std::set<std::tuple<std::string, std::uint32_t, std::uint32_t, std::uint32_t>> seen;
  std::set<std::string> modes;
  for (const ComparedMode& mode : request.modes) modes.insert(mode.name);
  for (int i = 0; i < message.done_size() && problems.size() < 20; ++i) {
    const pb::CompareUnit& unit = message.done(i);
    const std::string where = fmt::format("done[{}]", i);
    if (!modes.count(unit.mode()))
      problems.add(where + ".mode", "'" + unit.mode().substr(0, kMaxName) + "'; allowed: names of modes");
    if (unit.seed_number() < 1 || unit.seed_number() > request.seeds)
      problems.add(where + ".seed_number", fmt::format("{}; allowed: [1, {}]", unit.seed_number(), request.seeds));
    if (unit.budget() >= request.budgets.size())
      problems.add(where + ".budget", fmt::format("{}; allowed: below {}", unit.budget(), request.budgets.size()));
    if (unit.view() >= request.views.size())
      problems.add(where + ".view", fmt::format("{}; allowed: below {}", unit.view(), request.views.size()));
    for (const pb::CompareValue& value : unit.values()) {
      if (value.measure() < 1 || value.measure() > kMeasures || !std::isfinite(value.value()))
        problems.add(where + ".values", "a measure that there is not, or a value that is not finite");
      if (!(value.reference_error() >= 0) || !std::isfinite(value.reference_error()))
        problems.add(where + ".values",
                     fmt::format("reference_error {}; allowed: finite, >= 0", value.reference_error()));
    }
    if (!(unit.seconds() >= 0) || !std::isfinite(unit.seconds()) || !(unit.samples() >= 0) ||
        !std::isfinite(unit.samples()))
      problems.add(where, fmt::format("seconds {}, samples {}; allowed: finite, >= 0", unit.seconds(), unit.samples()));
    if (!seen.emplace(unit.mode(), unit.seed_number(), unit.budget(), unit.view()).second)
      problems.add(where, "is there twice; allowed: once");
  }
  request.done.assign(message.done().begin(), message.done().end());
}

void read_pictures_done(const pb::CompareRequest& message, ComparisonRequest& request, Problems& problems) {
  if (!request.send_pictures && message.pictures_done_size() > 0)
    problems.add("pictures_done", "is given without send_pictures; allowed: none");
  std::set<std::string> modes;
  for (const ComparedMode& mode : request.modes) modes.insert(mode.name);
  for (int i = 0; i < message.pictures_done_size() && problems.size() < 20; ++i) {
    const auto& name = message.pictures_done(i);
    const std::string where = fmt::format("pictures_done[{}]", i);
    if (name.reference() ? !name.mode().empty() : !modes.contains(name.mode())) {
      problems.add(where + ".mode", "'" + name.mode().substr(0, kMaxName) + "'; allowed: " +
                                        (name.reference() ? "empty, of a reference" : "names of modes"));
    }
    if (name.view() >= request.views.size())
      problems.add(where + ".view", fmt::format("{}; allowed: below {}", name.view(), request.views.size()));
    if (!request.pictures_done.emplace(name.mode(), name.view()).second)
      problems.add(where, "is there twice; allowed: once");
  }
}

}  // namespace

unsigned ComparedMode::channels() const {
  if (picture != Picture::display) return 0;
  return oidn ? kResolveDisplay | kDisplayByOidn : unsigned(kResolveDisplay);
}

std::uint64_t ComparisonRequest::seed(const ComparedMode& mode, std::uint32_t seed_number) const {
  const std::uint64_t key = common_seeds ? 0 : name_key(mode.name);
  return hash64(hash64(first_seed + 0x9e3779b97f4a7c15u * seed_number) ^ key) >> 11;
}

Result<ComparisonRequest> read_comparison(const pb::CompareRequest& message, const LoadedScene* scene,
                                          const ComparisonLimits& limits) {
  Problems problems;
  ComparisonRequest request;
  const bool path = message.views_size() > 1;
  if (message.modes_size() < 1 || message.modes_size() > kMaxModes)
    problems.add("modes", fmt::format("{}; allowed: [1, {}]", message.modes_size(), kMaxModes));
  std::set<std::string> names;
  for (int i = 0; i < std::min(message.modes_size(), kMaxModes); ++i) {
    const std::string where = fmt::format("modes[{}]", i);
    request.modes.push_back(read_mode(message.modes(i), limits, path, where, problems));
    if (!names.insert(request.modes.back().name).second)
      problems.add(where + ".name", "'" + request.modes.back().name + "' is there twice; allowed: other names");
    if (i > 0) check_like_first(request.modes.front(), request.modes.back(), where, problems);
  }
  if (message.views_size() > kMaxViews)
    problems.add("views", fmt::format("{} views; allowed: at most {}", message.views_size(), kMaxViews));
  static const std::vector<CameraDescription> kNone;
  const auto& cameras = scene ? scene->snapshot->description().cameras : kNone;
  for (int i = 0; i < std::min(message.views_size(), kMaxViews); ++i) {
    if (!scene && message.views(i).orientation_case() == pb::CameraView::kSceneCamera) {
      request.views.emplace_back();
    } else {
      request.views.push_back(read_camera(message.views(i), cameras, fmt::format("views[{}]", i), problems));
    }
  }
  if (message.has_gaze()) {
    request.gaze = Gaze{message.gaze().x(), message.gaze().y()};
    validate(*request.gaze, "gaze", problems);
  }
  if (request.views.empty()) request.views.push_back(scene ? camera_pose(cameras.front()) : CameraPose());
  request.seeds = message.seeds();
  if (request.seeds < 1 || request.seeds > kMaxSeeds)
    problems.add("seeds", fmt::format("{}; allowed: [1, {}]", request.seeds, kMaxSeeds));
  request.first_seed = message.first_seed();
  request.common_seeds = message.common_seeds();
  if ((message.samples_size() > 0) == (message.times_s_size() > 0))
    problems.add("samples", message.samples_size() > 0 ? "is given beside times_s; allowed: one of them"
                                                       : "is empty and so is times_s; one of them is required");
  request.budgets_are_seconds = message.times_s_size() > 0;
  if (request.budgets_are_seconds) {
    read_budgets(message.times_s(), kLeastTime, kMostTime, "times_s", request.budgets, problems);
  } else {
    read_budgets(message.samples(), 1, double(1u << 30), "samples", request.budgets, problems);
  }
  read_reference(message.reference(), request, limits, request.views.size(), problems);
  read_regions(message, request, problems);
  read_measures(message, request, problems);
  request.exclusive = message.exclusive();
  request.send_pictures = message.send_pictures();
  request.worst_pixels = message.worst_pixels();
  if (request.worst_pixels > kMaxWorstPixels)
    problems.add("worst_pixels", fmt::format("{}; allowed: [0, {}]", request.worst_pixels, kMaxWorstPixels));
  read_done(message, request, problems);
  read_pictures_done(message, request, problems);
  if (!problems.empty()) return problems.to_error();

  for (std::size_t i = 0; i < request.modes.size(); ++i) {
    const Status fits = check_film_size(request.modes[i].settings, limits.film, fmt::format("modes[{}].settings", i));
    if (!fits.ok()) return fits.error();
  }
  if (request.exclusive && !limits.allow_exclusive)
    return Error{ErrorCode::permission_denied, "this daemon does not let others wait (allow-exclusive)", "exclusive"};
  if (request.units() > limits.max_units) {
    return Error{
        ErrorCode::resource_exhausted,
        fmt::format("max_compare_units: {} modes x {} seeds x {} budgets x {} views; allowed: {}", request.modes.size(),
                    request.seeds, request.budgets.size(), request.views.size(), limits.max_units),
        {}};
  }
  // What a later call sends to go on: one message.
  std::size_t name = 0;
  for (const ComparedMode& mode : request.modes) name = std::max(name, mode.name.size());
  std::uint64_t unit_bytes = kUnitBytes + name + kMeasures * kValueBytes + kReferenceErrorBytes;
  const auto add_region = [&](std::size_t bytes) {
    unit_bytes += kRegionValues * (kValueBytes + 2 + bytes) + kReferenceErrorBytes;
  };
  add_region(std::string_view(kDarkHalf).size());
  for (const MeasuredRegion& region : request.errors.regions) add_region(region.name.size());
  if (request.units() * unit_bytes > kMostBytes) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("max_message_bytes: {} units take {} bytes of the message that a later call would go on "
                             "from; allowed: {}. Fewer regions, budgets, views or seeds do",
                             request.units(), request.units() * unit_bytes, kMostBytes),
                 {}};
  }
  const double pixels =
      double(request.modes.size()) * request.seeds * double(request.views.size()) * request.width() * request.height();
  if (pixels > double(limits.max_pixels)) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("max_compare_pixels: {} modes x {} seeds x {} views of {} x {} pixels; allowed: {}",
                             request.modes.size(), request.seeds, request.views.size(), request.width(),
                             request.height(), limits.max_pixels),
                 {}};
  }
  return request;
}

pb::CompareMode to_message(const ComparedMode& mode) {
  pb::CompareMode message;
  message.set_name(mode.name);
  *message.mutable_settings() = to_message(mode.settings);
  switch (mode.picture) {
    case ComparedMode::Picture::film:
      message.set_picture(pb::COMPARED_PICTURE_FILM);
      break;
    case ComparedMode::Picture::display:
      message.set_picture(pb::COMPARED_PICTURE_DISPLAY);
      break;
    case ComparedMode::Picture::preview:
      message.set_picture(pb::COMPARED_PICTURE_PREVIEW);
      break;
  }
  if (mode.oidn) message.set_denoiser(pb::DENOISER_OIDN);
  return message;
}

}  // namespace helio
