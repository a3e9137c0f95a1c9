#include "client/cli/commands/compare_script.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <system_error>

#include "client/cli/commands/picture_files.h"
#include "client/cli/foveation_options.h"
#include "client/enum_names.h"
#include "renderer/base/gaze_density.h"
#include "renderer/base/pixel_disk.h"
#include "renderer/codec/tile_codec.h"

namespace helio::cli {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxBudgets = 64, kMaxRegions = 16, kMaxRegionName = 64;
constexpr std::uint32_t kDefaultSeeds = 5;
constexpr const char* kDefaultSamples = "1..64";
constexpr const char* kDarkHalf = "dark half";
constexpr std::uint64_t kMaxReferencePixels = std::uint64_t(1) << 28;
constexpr NumberRange kTimes{1e-3, 86400};

std::optional<double> parse_number(const std::string& text) {
  double value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// One budget, or FROM..TO: doubled from FROM on, and TO.
std::optional<std::vector<double>> parse_budgets(const std::string& text) {
  const std::size_t dots = text.find("..");
  if (dots == std::string::npos) {
    const auto value = parse_number(text);
    return value ? std::optional(std::vector<double>{*value}) : std::nullopt;
  }
  const auto from = parse_number(text.substr(0, dots)), to = parse_number(text.substr(dots + 2));
  if (!from || !to || !(*from > 0) || !(*from < *to) || !std::isfinite(*to)) return std::nullopt;
  std::vector<double> values;
  for (double value = *from; value < *to; value *= 2) values.push_back(value);
  values.push_back(*to);
  return values;
}

std::vector<double> read_budgets(const TextOption& option, const std::string& text, const NumberRange& range,
                                 bool whole, OptionReader& reader) {
  std::vector<double> budgets;
  std::size_t start = 0;
  while (start <= text.size()) {
    const std::size_t end = std::min(text.find(',', start), text.size());
    const std::string part = text.substr(start, end - start);
    start = end + 1;
    const auto values = parse_budgets(part);
    const bool fits = values && std::all_of(values->begin(), values->end(), [&](double value) {
                        return range.contains(value) && (!whole || value == std::floor(value));
                      });
    if (!fits) {
      reader.problem(option, fmt::format("'{}' is no {} in {}, and no two of them with .. between, such as 1..64", part,
                                         whole ? "integer" : "number", range.to_string()));
      continue;
    }
    if (!budgets.empty() && !(values->front() > budgets.back())) {
      reader.problem(option,
                     fmt::format("'{}' stands behind {}; allowed: rising ones", part, number_text(budgets.back())));
      continue;
    }
    budgets.insert(budgets.end(), values->begin(), values->end());
  }
  if (budgets.size() > kMaxBudgets)
    reader.problem(option, fmt::format("{} budgets; allowed: [1, {}]", budgets.size(), kMaxBudgets));
  return budgets;
}

// "disk:x,y,r" and "outside:x,y,r". None: it is neither.
std::optional<pb::CompareRegion::Disk> parse_disk(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  if (colon == std::string::npos || (kind != "disk" && kind != "outside")) return std::nullopt;
  double values[3];
  std::size_t start = colon + 1;
  for (int i = 0; i < 3; ++i) {
    const std::size_t end = i < 2 ? text.find(',', start) : text.size();
    if (end == std::string::npos) return std::nullopt;
    const auto value = parse_number(text.substr(start, end - start));
    const bool good = value && std::abs(*value) <= kMostGazePixels && (i < 2 || *value > 0);
    if (!good) return std::nullopt;
    values[i] = *value;
    start = end + 1;
  }
  pb::CompareRegion::Disk disk;
  disk.set_x(values[0]);
  disk.set_y(values[1]);
  disk.set_radius(values[2]);
  disk.set_outside(kind == "outside");
  return disk;
}

constexpr const char* kRegionForms = "NAME=x0,y0,x1,y1, NAME=disk:x,y,radius or NAME=outside:x,y,radius";

void read_regions(const CompareScriptOptions& options, pb::CompareRequest& request, Problems& problems) {
  std::set<std::string> names{kDarkHalf};
  for (const std::string& text : options.regions) {
    const std::size_t equals = text.rfind('=');
    const std::string name = as_utf8(text.substr(0, equals));
    if (equals == std::string::npos || name.empty() || name.size() > kMaxRegionName) {
      problems.add("--region",
                   fmt::format("'{}' is not {} with a name of 1 to {} bytes", text, kRegionForms, kMaxRegionName));
      continue;
    }
    if (!names.insert(name).second) {
      problems.add("--region",
                   "'" + name + (name == kDarkHalf ? "' is a region that every comparison has" : "' is there twice"));
    }
    if (const auto disk = parse_disk(text.substr(equals + 1))) {
      pb::CompareRegion& region = *request.add_regions();
      region.set_name(name);
      *region.mutable_disk() = *disk;
      continue;
    }
    int values[4];
    const char *at = text.data() + equals + 1, *const end = text.data() + text.size();
    bool good = true;
    for (int i = 0; i < 4 && good; ++i) {
      const auto [next, problem] = std::from_chars(at, end, values[i]);
      good = problem == std::errc() && (i < 3 ? next != end && *next == ',' : next == end);
      at = next + (i < 3 ? 1 : 0);
    }
    if (!good || values[0] < 0 || values[1] < 0 || values[2] <= values[0] || values[3] <= values[1]) {
      problems.add("--region",
                   fmt::format("'{}' is not {} in pixels with 0 <= x0 < x1, 0 <= y0 < y1 and 0 < radius", text,
                               kRegionForms));
      continue;
    }
    pb::CompareRegion& region = *request.add_regions();
    region.set_name(name);
    region.mutable_rect()->set_x0(values[0]);
    region.mutable_rect()->set_y0(values[1]);
    region.mutable_rect()->set_x1(values[2]);
    region.mutable_rect()->set_y1(values[3]);
  }
  if (options.regions.size() > kMaxRegions)
    problems.add("--region", fmt::format("{} regions; allowed: at most {}", options.regions.size(), kMaxRegions));
}

void read_measures(const CompareScriptOptions& options, bool path, OptionReader& reader, pb::CompareRequest& request) {
  std::set<std::string> seen;
  for (const std::string& name : reader.choices(options.measures, short_names(*pb::CompareMeasure_descriptor()))) {
    const auto measure = from_short_name<pb::CompareMeasure>(name).value();
    if (measure == pb::COMPARE_MEASURE_FLICKER && !path)
      reader.problem(options.measures, "'flicker' compares views of a path, which --path gives");
    if (seen.insert(name).second) request.add_measures(measure);
  }
}

void read_reference(const CompareScriptOptions& options, OptionReader& reader, pb::CompareRequest& request) {
  const bool files = options.reference.given() && options.reference.text != "auto";
  for (const TextOption* option :
       {&options.reference_error, &options.reference_samples, &options.reference_integrator}) {
    if (files && option->given()) reader.problem(*option, "is only valid with --reference auto: a file has its own");
  }
  pb::CompareReference::Rendered& rendered = *request.mutable_reference()->mutable_rendered();
  rendered.set_error(reader.number(options.reference_error, {1e-4, 1}).value_or(0.01));
  const std::uint64_t samples = reader.integer(options.reference_samples, 2, 1u << 30).value_or(65536);
  if (samples % 2 != 0)
    reader.problem(options.reference_samples,
                   fmt::format("'{}' is odd; allowed: even ones in [2, {}]", samples, 1 << 30));
  rendered.set_max_samples(std::uint32_t(samples));
  static_cast<void>(reader.choice(options.reference_integrator, {"path", "bdpt", "pt+bdpt"}));
  if (files) request.mutable_reference()->mutable_loaded();
}

}  // namespace

void add_compare_script_options(CLI::App& app, CompareScriptOptions& options) {
  add_text(app, options.seeds, "--seeds", "N",
           "Pictures of each mode with seeds of their own, [1, 1000]; below five there are no intervals. Default: 5");
  add_text(app, options.samples, "--samples", "LIST",
           "Budgets in samples per pixel, rising, comma-separated, at most 64, each in " + kSampleBudget.to_string() +
               "; 1..64: 1 doubled up to 64. Default: 1..64");
  add_text(app, options.time, "--time", "LIST",
           "Budgets in seconds of wall time of a view, written in the same way, each in " + kTimes.to_string());
  add_text(
      app, options.reference, "--reference", "FILE.exr|auto",
      "What pictures are compared with: an EXR with R, G, B and, where known, variance.R, variance.G, variance.B; of "
      "a path a folder that holds reference.view0.exr, reference.view1.exr, ..., or a name with #### for the view's "
      "number. Default: auto, rendered first with mode pt");
  add_text(
      app, options.reference_error, "--reference-error", "E",
      "Root of the relative mean square error down to which the reference is rendered, [0.0001, 1]. Default: 0.01");
  add_text(app, options.reference_samples, "--reference-samples", "N",
           "Samples per pixel that the reference gets at most, even, [2, 2^30]. Default: 65536");
  add_text(app, options.reference_integrator, "--reference-integrator", "NAME",
           "Integrator that renders the reference: path, bdpt, pt+bdpt. Default: path");
  add_texts(app, options.regions, "--region", "NAME=x0,y0,x1,y1",
            "A part of the picture whose errors are told apart: a rectangle, NAME=disk:x,y,radius, or "
            "NAME=outside:x,y,radius, in pixels; may be repeated, at most 16");
  add_text(app, options.gaze, "--gaze", "x,y",
           "Where somebody looks, of modes with foveation, pixels from the picture's upper left corner. Default: its "
           "centre");
  add_text(app, options.measures, "--measures", "LIST",
           "What is measured, comma-separated: " + join(short_names(*pb::CompareMeasure_descriptor()), ", ") +
               ". flicker needs --path. Default: all that apply");
  add_flag(app, options.common_seeds, "--common-seeds",
           "Give all modes the same seeds, so that ratios are paired by seed. Default: each mode has its own");
  add_flag(app, options.exclusive, "--exclusive",
           "Keep everything else waiting while a mode is measured; the daemon has to be configured to allow it");
  add_text(app, options.worst_pixels, "--worst-pixels", "N",
           "Worst pixels to keep of each picture of the last budget, [0, 64]. Default: 8");
}

void read_compare_script(const CompareScriptOptions& options, const TextOption& seed, bool path, OptionReader& reader,
                         pb::CompareRequest& request) {
  request.set_seeds(std::uint32_t(reader.integer(options.seeds, 1, 1000).value_or(kDefaultSeeds)));
  Problems told;  // with the other settings
  request.set_first_seed(OptionReader(told).integer(seed, 0, std::numeric_limits<std::uint64_t>::max()).value_or(0));
  request.set_common_seeds(options.common_seeds);
  if (options.time.given()) {
    if (options.samples.given()) reader.problem(options.time, "does not go with --samples");
    for (const double seconds : read_budgets(options.time, options.time.text, kTimes, false, reader))
      request.add_times_s(seconds);
  } else {
    const std::string text = options.samples.given() ? options.samples.text : kDefaultSamples;
    for (const double samples : read_budgets(options.samples, text, kSampleBudget, true, reader))
      request.add_samples(std::uint32_t(samples));
  }
  read_reference(options, reader, request);
  read_regions(options, request, reader.problems());
  if (const auto gaze = read_point(options.gaze, reader)) *request.mutable_gaze() = *gaze;
  read_measures(options, path, reader, request);
  request.set_exclusive(options.exclusive);
  request.set_send_pictures(true);
  request.set_worst_pixels(std::uint32_t(reader.integer(options.worst_pixels, 0, 64).value_or(8)));
}

void check_regions(const pb::CompareRequest& request, int width, int height, Problems& problems) {
  if (width <= 0 || height <= 0) return;
  for (const pb::CompareRegion& region : request.regions()) {
    if (region.has_disk()) {
      const pb::CompareRegion::Disk& disk = region.disk();
      if (!PixelDisk{disk.x(), disk.y(), disk.radius(), disk.outside()}.has_pixels(width, height))
        problems.add("--region", fmt::format("'{}' has no pixel of the picture; allowed: a part of {}x{}",
                                             region.name(), width, height));
      continue;
    }
    const pb::Rect& r = region.rect();
    if (r.x1() <= width && r.y1() <= height) continue;
    problems.add("--region", fmt::format("'{}={},{},{},{}' reaches out of the picture; allowed: inside {}x{}",
                                         region.name(), r.x0(), r.y0(), r.x1(), r.y1(), width, height));
  }
}

std::string ReferenceFiles::file(int view) const {
  std::error_code ignored;
  if (fs::is_directory(name, ignored)) return (fs::path(name) / fmt::format("reference.view{}.exr", view)).string();
  const bool pattern = fs::path(name).filename().string().find('#') != std::string::npos;
  return pattern ? numbered_name(name, view) : name;
}

ReferenceFiles read_reference_files(const CompareScriptOptions& options, OptionReader& reader) {
  const std::string name = reader.text(options.reference).value_or("auto");
  return {name == "auto" ? "" : name};
}

std::optional<std::pair<int, int>> check_reference(const ReferenceFiles& files, int view, std::pair<int, int> size,
                                                   OptionReader& reader, const TextOption& option) {
  const std::string path = files.file(view);
  const auto refuse = [&](const std::string& why) {
    reader.problem(option, "'" + path + "' " + why);
    return std::nullopt;
  };
  if (view > 0 && path == files.file(0))
    return refuse("is one file; of several views a folder, or a name with #### for the view's number, is needed");
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return refuse("is no file");
  const auto picture = read_exr(path, kMaxReferencePixels);
  if (!picture) return refuse("cannot be read: " + picture.error().to_string());
  const TileHeader& header = picture->header;
  const std::pair<int, int> found(header.frame_width, header.frame_height);
  if (!(header.data_window == PixelRect{0, 0, found.first, found.second}))
    return refuse(fmt::format("holds a part of a picture of {}x{}; allowed: the whole", found.first, found.second));
  if (size.first > 0 && size != found)
    return refuse(fmt::format("has {}x{} pixels; allowed: {}x{}, the size of the pictures", found.first, found.second,
                              size.first, size.second));
  for (const char* channel : {"R", "G", "B"}) {
    const std::vector<float>* const plane = picture->find(channel);
    if (!plane) return refuse(fmt::format("has no channel {}; allowed: an EXR with R, G and B", channel));
    const auto bad = std::find_if(plane->begin(), plane->end(), [](float value) { return !std::isfinite(value); });
    if (bad == plane->end()) continue;
    const auto pixel = bad - plane->begin();
    return refuse(fmt::format("has {} {} at ({}, {}); allowed: finite values", channel, *bad, pixel % found.first,
                              pixel / found.first));
  }
  return found;
}

std::string as_utf8(const std::string& text) {
  const std::string quoted = Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
  return Json::parse(quoted).get<std::string>();
}

}  // namespace helio::cli
