#include "client/cli/compare_modes.h"

#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <utility>

#include "client/cli/foveation_options.h"
#include "client/enum_names.h"
#include "server/stream/settings_messages.h"

namespace helio::cli {

namespace {

constexpr const char* kDefaultModes = "pt,combined,pt+bdpt";
constexpr std::size_t kMaxModes = 64, kMaxName = 64;
constexpr double kPreviewRate = 20;  // as of `move --play`

// A word and the settings that it stands for; null: not chosen by it, so that an option may.
struct Word {
  const char *name, *mode, *variant, *integrator;
  pb::ComparedPicture picture = pb::COMPARED_PICTURE_FILM;
  const char* denoiser = nullptr;
};
constexpr Word kWords[] = {
    {"pt", "pt", nullptr, nullptr},
    {"adaptive", "adaptive", nullptr, nullptr},
    {"reproject", "reproject", nullptr, nullptr},
    {"combined", "combined", nullptr, nullptr},
    {"path", nullptr, nullptr, "path"},
    {"bdpt", nullptr, nullptr, "bdpt"},
    {"pt+bdpt", nullptr, nullptr, "pt+bdpt"},
    {"lvc", nullptr, nullptr, "lvc"},
    {"vcm", nullptr, nullptr, "vcm"},
    {"photon", nullptr, nullptr, "photon"},
    {"light", nullptr, nullptr, "light"},
    {"paper-adaptive", "adaptive", "paper", nullptr},
    {"paper-reproject", "reproject", "paper", nullptr},
    {"paper-combined", "combined", "paper", nullptr},
    {"display", nullptr, nullptr, nullptr, pb::COMPARED_PICTURE_DISPLAY},
    {"oidn", nullptr, nullptr, nullptr, pb::COMPARED_PICTURE_DISPLAY, "oidn"},
    {"preview", nullptr, nullptr, nullptr, pb::COMPARED_PICTURE_PREVIEW},
};

const Word* find_word(const std::string& name) {
  for (const Word& word : kWords)
    if (name == word.name) return &word;
  return nullptr;
}

std::string all_words() {
  std::vector<std::string> names;
  for (const Word& word : kWords) names.emplace_back(word.name);
  return join(names, ", ");
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t start = 0;
  for (std::size_t end; (end = text.find(separator, start)) != std::string::npos; start = end + 1)
    parts.push_back(text.substr(start, end - start));
  parts.push_back(text.substr(start));
  return parts;
}

bool is_alphanumeric(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
}

bool fits_a_name(char c) {
  return is_alphanumeric(c) || c == '.' || c == '_' || c == '+' || c == '-';
}

// "combined:adaptive-min=8" -> "combined-adaptive-min-8".
std::string name_of(const std::string& text) {
  std::string name = text;
  for (char& c : name) {
    if (c == ':' || c == '=') {
      c = '-';
    } else if (!fits_a_name(c)) {
      c = '_';
    }
  }
  return name;
}

std::string problem_of_name(const std::string& name) {
  if (!name.empty() && name.size() <= kMaxName && is_alphanumeric(name[0]) &&
      std::all_of(name.begin(), name.end(), fits_a_name))
    return {};
  return fmt::format(
      "'{}' is no name of a mode: 1 to {} of A-Z, a-z, 0-9, '.', '_', '+', '-', the first a letter or "
      "digit; --mode NAME=WORD... gives one",
      name.substr(0, 2 * kMaxName), kMaxName);
}

// As if it stood on a command line.
void give(TextOption& option, const std::string& value) {
  option.option->add_result(value);
  option.text = value;
}

}  // namespace

// Options of one mode in an app of their own.
struct ChosenMode::Impl {
  CLI::App app;
  SettingsOptions options;
  TextOption preview_rate, preview_budget, preview_upscaling, denoiser;
  FoveationOptions foveation;
  std::set<std::string> own;  // options that the mode's text gives, "--adaptive-min"
  std::string place;          // "--modes combined"
  pb::CompareMode message;

  Impl() {
    add_settings_options(app, options);
    add_text(app, preview_rate, "--preview-rate", "HZ", "");
    add_text(app, preview_budget, "--preview-budget", "MS", "");
    add_text(app, preview_upscaling, "--preview-upscaling", "on|off", "");
    add_foveation_options(app, foveation);
    add_text(app, denoiser, "--denoiser", "NAME", "");
  }

  // Those that differ from mode to mode.
  std::map<std::string, TextOption*> by_name() {
    std::map<std::string, TextOption*> all;
    for (auto& [path, option] : options.fields) all.emplace(option.option->get_name().substr(2), &option);
    for (TextOption* option : {&options.technique, &preview_rate, &preview_budget, &preview_upscaling, &denoiser})
      all.emplace(option->option->get_name().substr(2), option);
    for (TextOption* option : foveation.all()) all.emplace(option->option->get_name().substr(2), option);
    return all;
  }

  bool is_common(const std::string& flag) const {
    for (const TextOption* option : {&options.size, &options.camera, &options.seed, &options.filter, &options.region})
      if (option->option->get_name() == flag) return true;
    return false;
  }

  // Adds problems of the options, each once, named by where the mode has them from.
  void tell(const Problems& found, Problems& problems) const {
    for (const Problems::Item& item : found.items()) {
      std::string where = item.where;
      if (own.contains(where)) {
        where = place + ":" + where.substr(2);
      } else if (!is_common(where)) {
        where = place + ": " + where;
      }
      const auto& told = problems.items();
      const bool known = std::any_of(told.begin(), told.end(), [&](const Problems::Item& other) {
        return other.where == where && other.message == item.message;
      });
      if (!known) problems.add(where, item.message);
    }
  }

  void take_common(const SettingsOptions& common) {
    const std::pair<const TextOption*, TextOption*> same[] = {{&common.size, &options.size},
                                                              {&common.filter, &options.filter}};
    for (const auto& [given, taken] : same)
      if (given->given()) give(*taken, given->text);
    for (const auto& [path, option] : common.fields) {
      TextOption& taken = options.fields.at(path);
      if (option.given() && !taken.given()) give(taken, option.text);
    }
  }

  void read_options(const std::vector<std::string>& texts, Problems& problems) {
    const auto all = by_name();
    for (const std::string& text : texts) {
      const std::size_t equals = text.find('=');
      const std::string name = text.substr(0, equals);
      const auto option = all.find(name);
      if (option == all.end() && is_common("--" + name)) {
        problems.add(place, name == "seed" || name == "region" || name == "camera"
                                ? "'" + name + "' is no option of a mode"
                                : "'" + name + "' is the same for all modes: --" + name + " gives it");
      } else if (option == all.end()) {
        std::vector<std::string> names;
        for (const auto& [known, unused] : all) names.push_back(known);
        problems.add(place, "'" + name + "' is no option of a mode: " + join(names, ", "));
      } else if (equals == std::string::npos) {
        problems.add(place, "'" + name + "' has no value: " + name + "=VALUE");
      } else if (!own.insert("--" + name).second) {
        problems.add(place, "'" + name + "' is given twice");
      } else {
        give(*option->second, text.substr(equals + 1));
      }
    }
  }

  // Sets the options that the word itself chooses.
  void take_word(const Word& word, Problems& problems) {
    const std::pair<const char*, TextOption*> chosen[] = {{word.mode, &options.fields.at("mode")},
                                                          {word.variant, &options.fields.at("variant")},
                                                          {word.integrator, &options.fields.at("integrator")},
                                                          {word.denoiser, &denoiser}};
    for (const auto& [value, option] : chosen) {
      if (!value) continue;
      if (option->given()) {
        problems.add(
            place + ":" + option->option->get_name().substr(2),
            fmt::format("'{}' is chosen by the word '{}' already, which means {}", option->text, word.name, value));
        own.erase(option->option->get_name());
      } else {
        give(*option, value);
      }
    }
    message.set_picture(word.picture);
  }

  void read_picture(OptionReader& reader) {
    const bool display = message.picture() == pb::COMPARED_PICTURE_DISPLAY;
    const bool preview = message.picture() == pb::COMPARED_PICTURE_PREVIEW;
    pb::RenderSettings& settings = *message.mutable_settings();
    if (denoiser.given() && !display) reader.problem(denoiser, "is only valid with the words display and oidn");
    if (reader.choice(denoiser, {"own", "oidn"}).value_or("own") == "oidn") message.set_denoiser(pb::DENOISER_OIDN);
    for (const TextOption* option : {&preview_rate, &preview_budget, &preview_upscaling})
      if (option->given() && !preview) reader.problem(*option, "is only valid with the word preview");
    if (preview) settings.set_preview_rate(reader.number(preview_rate, {0, 120, false}).value_or(kPreviewRate));
    if (const auto budget = reader.number(preview_budget, {5, 1000})) settings.set_preview_budget_ms(*budget);
    settings.set_preview_upscaling(reader.choice(preview_upscaling, {"on", "off"}) == "on");
    static_cast<void>(read_foveation(foveation, reader, settings));
  }
};

ChosenMode::ChosenMode(const std::string& text, const std::string& name, const std::string& option,
                       const SettingsOptions& common, Problems& problems)
    : impl_(std::make_unique<Impl>()) {
  std::vector<std::string> parts = split(text, ':');
  const std::string word_name = parts[0] == "pt-bdpt" ? "pt+bdpt" : parts[0];
  parts.erase(parts.begin());
  impl_->place = option + " " + (name.empty() ? word_name : name);
  impl_->message.set_name(name.empty() ? name_of(text) : name);
  if (const std::string problem = problem_of_name(impl_->message.name()); !problem.empty() && !word_name.empty())
    problems.add(option, problem);
  const Word* const word = find_word(word_name);
  if (!word) {
    problems.add(option, "'" + word_name + "' is none of " + all_words());
    return;
  }
  const std::size_t before = problems.size();
  impl_->read_options(parts, problems);
  impl_->take_word(*word, problems);
  if (problems.size() > before) return;
  impl_->take_common(common);
  Problems found;
  OptionReader reader(found);
  const bool preview = word->picture == pb::COMPARED_PICTURE_PREVIEW;
  if (preview && !impl_->options.fields.at("mode").given()) give(impl_->options.fields.at("mode"), "combined");
  *impl_->message.mutable_settings() = read_settings(impl_->options, reader);
  impl_->read_picture(reader);
  impl_->tell(found, problems);
}

ChosenMode::~ChosenMode() = default;
ChosenMode::ChosenMode(ChosenMode&&) noexcept = default;
ChosenMode& ChosenMode::operator=(ChosenMode&&) noexcept = default;

const pb::CompareMode& ChosenMode::message() const {
  return impl_->message;
}
pb::CompareMode& ChosenMode::message() {
  return impl_->message;
}
bool ChosenMode::needs_path() const {
  return impl_->message.picture() == pb::COMPARED_PICTURE_PREVIEW;
}
bool ChosenMode::needs_oidn() const {
  return impl_->message.denoiser() == pb::DENOISER_OIDN;
}

void ChosenMode::check_against_server(const pb::GetServerInfoResponse& server, Problems& problems) const {
  Problems found;
  OptionReader reader(found);
  cli::check_against_server(impl_->options, impl_->message.settings(), server, reader);
  impl_->tell(found, problems);
}

void ChosenMode::complete(const pb::SceneInfo& scene, const pb::SceneCamera& camera) {
  pb::RenderSettings& settings = *impl_->message.mutable_settings();
  set_defaults(settings, scene, camera);
  settings.clear_region();  // whole pictures are compared, also where the file crops its own
  Problems ignored;         // check_against_server() tells of them
  pb::RenderSettings whole = to_message(helio::read_settings(settings, {}, "", ignored));
  if (ignored.empty()) settings = whole;
}

namespace {

void add_mode(ChosenMode mode, std::vector<ChosenMode>& modes, const std::string& option, Problems& problems) {
  const std::string& name = mode.message().name();
  const bool known =
      std::any_of(modes.begin(), modes.end(), [&](const ChosenMode& other) { return other.message().name() == name; });
  if (known) problems.add(option, "'" + name + "' is there twice; --mode NAME=WORD... gives another name");
  modes.push_back(std::move(mode));
}

}  // namespace

std::vector<ChosenMode> read_compare_modes(const CompareModeOptions& options, Problems& problems) {
  // A problem of the common ones is told once, not of each mode.
  Problems of_common;
  OptionReader reader(of_common);
  static_cast<void>(read_settings(options.common, reader));
  for (const Problems::Item& item : of_common.items()) problems.add(item.where, item.message);
  static const SettingsOptions kNone;
  const SettingsOptions& common = of_common.empty() ? options.common : kNone;

  std::vector<ChosenMode> modes;
  const std::string list = options.list.given() ? options.list.text : options.named.empty() ? kDefaultModes : "";
  if (options.list.given() || !list.empty()) {
    for (const std::string& text : split(list, ','))
      add_mode(ChosenMode(text, "", "--modes", common, problems), modes, "--modes", problems);
  }
  for (const std::string& text : options.named) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    if (equals == std::string::npos || name.find(':') != std::string::npos) {
      problems.add("--mode", "'" + text + "' is not NAME=WORD[:option=value...]");
    } else if (const std::string problem = problem_of_name(name); !problem.empty()) {
      problems.add("--mode", problem);
    } else {
      add_mode(ChosenMode(text.substr(equals + 1), name, "--mode", common, problems), modes, "--mode", problems);
    }
  }
  if (modes.size() > kMaxModes)
    problems.add("--modes", fmt::format("{} modes; allowed: [1, {}]", modes.size(), kMaxModes));
  return modes;
}

pb::RenderSettings reference_settings(pb::RenderSettings settings) {
  settings.set_mode(pb::MODE_PT);
  settings.clear_variant();
  settings.set_integrator(pb::INTEGRATOR_PATH);
  settings.clear_technique();
  settings.clear_adaptive();
  settings.clear_reprojection();
  settings.clear_light_cache();
  settings.clear_preview_rate();
  settings.clear_preview_budget_ms();
  settings.clear_preview_upscaling();
  settings.clear_foveation();
  settings.clear_foveation_paper();
  settings.clear_viewing_distance();
  return settings;
}

const char* const kCompareModesHelp =
    "A mode is a word, and behind it, separated by colons, options that render has, without their dashes:\n"
    "  pt, adaptive, reproject, combined  as --mode of render\n"
    "  path, bdpt, pt+bdpt, lvc, vcm, photon, light  as --integrator of render, in mode pt\n"
    "  paper-adaptive, paper-reproject, paper-combined  the published method, --variant paper\n"
    "  display, oidn  pt, compared by the layer display: filtered by this program, or by Open Image Denoise\n"
    "  preview        combined, compared by its previews; only with --path. preview:foveation=density and\n"
    "                 preview:foveation=paper follow --gaze, as in move\n"
    "Examples: combined:integrator=bdpt, pt:roulette-from=8, adaptive:adaptive-min=8, preview:preview-budget=20. A\n"
    "mode is called by its text, with '-' for ':' and '=', unless --mode names it; a value with a comma needs --mode.\n"
    "The first mode is the one that the others are compared with.\n";

void add_compare_mode_options(CLI::App& app, CompareModeOptions& options) {
  add_text(app, options.list, "--modes", "LIST",
           "Modes to compare, comma-separated, at most 64, described below. Default: " + std::string(kDefaultModes) +
               "; with --mode: none but those");
  add_texts(app, options.named, "--mode", "NAME=MODE",
            "One more mode, by a name of your own: fast=adaptive:adaptive-min=4. May be repeated");
  add_picture_options(app, options.common);
  // Whole pictures are compared; --region names parts of them.
  app.remove_option(options.common.region.option);
  options.common.region.option = nullptr;
  add_text(app, options.common.fields["max_segments"], "--max-segments", "N",
           "Maximum path length of modes that do not say their own, in segments, " +
               find_field("max_segments", {})->range.to_string() +
               "; at most 256 with every integrator but path. Default: the scene file's, else 10");
}

}  // namespace helio::cli
