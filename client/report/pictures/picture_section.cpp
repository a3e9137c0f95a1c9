#include "client/report/pictures/picture_section.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "client/report/html_text.h"
#include "client/report/measure_names.h"
#include "client/report/number_text.h"
#include "client/report/page_parts.h"
#include "client/report/pictures/difference_maps.h"
#include "client/report/pictures/loaded_picture.h"
#include "client/report/pictures/picture_choice.h"
#include "client/report/pictures/rgbe_bytes.h"
#include "client/report/pictures/worst_pixels.h"
#include "renderer/codec/display_image.h"

namespace helio::report {
namespace {

namespace fs = std::filesystem;

struct Stage {
  const ReportData& data;
  const fs::path& folder;
  PictureChoice choice;
};

// Kinds of maps that a view has.
struct MapKinds {
  bool flip = false, standard_errors = false, relative = false;
};

std::string data_url(const std::vector<std::uint8_t>& png) {
  return "data:image/png;base64," + base64(png);
}

// `name` is what the stage lists it by.
std::string figure(const std::string& name, std::uint32_t view, const char* kind, int width, int height,
                   const std::vector<std::uint8_t>& png, const std::string& payload, const std::string& caption) {
  return fmt::format(
      "<figure class=\"picture\" data-kind=\"{0}\" data-view=\"{1}\" data-name=\"{2}\"><img alt=\"{2}, view {3}\" "
      "width=\"{4}\" height=\"{5}\" src=\"{6}\">{7}<figcaption>{8}</figcaption></figure>\n",
      kind, view, escaped(name), view + 1, width, height, data_url(png), payload, caption);
}

std::string radiance_figure(const std::string& name, std::uint32_t view, const LoadedPicture& picture, double exposure,
                            const std::string& caption) {
  const PictureView pixels = picture.view();
  const std::string payload =
      "<script type=\"application/octet-stream\">" + base64(zlib_bytes(rgbe_planes(pixels))) + "</script>";
  return figure(name, view, "radiance", picture.width, picture.height,
                png_of_rgb(picture.width, picture.height, display_bytes(pixels, exposure)), payload, caption);
}

std::string map_figure(const std::string& name, std::uint32_t view, const DifferenceMap& map, const Palette& palette,
                       const std::string& caption) {
  return figure(name, view, "map", map.width, map.height, to_png(map, palette), "", caption);
}

std::string absent_figure(const std::string& text) {
  return "<figure class=\"picture absent\"><p>" + escaped(text) + "</p></figure>\n";
}

// The palette from left to right, with what its ends and its middle stand for.
std::string palette_scale(const Palette& palette, const std::string& id, const std::string& title,
                          const std::string& left, const std::string& middle, const std::string& right) {
  std::string stops;
  constexpr int kStops = 16;
  for (int i = 0; i <= kStops; ++i) {
    const auto& c = palette[std::size_t(i * 255 / kStops)];
    stops += fmt::format("<stop offset=\"{:.4f}\" stop-color=\"#{:02x}{:02x}{:02x}\"/>", double(i) / kStops, c[0], c[1],
                         c[2]);
  }
  return fmt::format(
      "<figure class=\"scale\"><figcaption>{0}</figcaption><svg role=\"img\" aria-label=\"Colour scale of {0}\" "
      "viewBox=\"0 0 300 34\"><defs><linearGradient id=\"{1}\">{2}</linearGradient></defs><rect width=\"300\" "
      "height=\"14\" fill=\"url(#{1})\"/><g class=\"ticks\"><text x=\"0\" y=\"30\">{3}</text><text x=\"150\" y=\"30\" "
      "text-anchor=\"middle\">{4}</text><text x=\"300\" y=\"30\" text-anchor=\"end\">{5}</text></g></svg></figure>\n",
      escaped(title), id, stops, left, middle, right);
}

const pb::CompareUnit* shown_unit(const ReportData& data, std::size_t mode, std::uint32_t view) {
  const pb::CompareUnit* best = nullptr;
  for (const pb::CompareUnit& unit : data.record().units()) {
    if (unit.mode() != data.mode_name(mode) || unit.view() != view || unit.seed_number() != 1) continue;
    if (!best || unit.budget() > best->budget()) best = &unit;
  }
  return best;
}

std::string mode_caption(const ReportData& data, std::size_t mode, std::uint32_t view) {
  std::string text = "<strong>" + escaped(data.mode_name(mode)) + "</strong>";
  const pb::CompareUnit* unit = shown_unit(data, mode, view);
  if (!unit) return text;
  text +=
      fmt::format(", seed {}, {} samples, {} s", unit->seed(), plain_number(unit->samples()), number(unit->seconds()));
  for (const pb::CompareValue& value : unit->values()) {
    if (value.measure() != pb::COMPARE_MEASURE_RELMSE || !value.region().empty()) continue;
    text += ", relative MSE " + number(value.value());
  }
  return text;
}

std::string signed_caption(bool standard_errors) {
  return standard_errors ? "signed difference of luminance in standard errors (z), from the variances of both files"
                         : "signed relative difference of luminance (the variance is not known)";
}

// The three figures of a mode.
std::string mode_row(const Stage& stage, std::size_t mode, std::uint32_t view,
                     const std::optional<LoadedPicture>& reference, double exposure, MapKinds& kinds) {
  const std::string name = stage.data.mode_name(mode);
  const auto file = mode_file(stage.data, stage.folder, mode, view);
  if (!file) return absent_figure(name + ": there is no picture of this mode.");
  const Result<LoadedPicture> loaded = load_picture(*file);
  if (!loaded) return absent_figure(name + ": the picture cannot be shown: " + loaded.error().message + ".");
  const int factor = stage.choice.factor;
  std::string html =
      radiance_figure(name, view, reduced(*loaded, factor), exposure, mode_caption(stage.data, mode, view));
  if (!reference) return html;
  if (loaded->width != reference->width || loaded->height != reference->height) {
    return html + absent_figure(name + ": the picture is not of the reference's size, so there are no maps.");
  }
  if (const Result<FlipMap> flip = flip_map(*loaded, *reference); flip) {
    kinds.flip = true;
    html += map_figure(name + ": HDR-FLIP", view, reduced(flip->map, factor), flip_palette(),
                       fmt::format("HDR-FLIP, mean {}, weighted median {}", number(flip->mean), number(flip->median)));
  } else {
    html += absent_figure(name + ": there is no HDR-FLIP map: " + flip.error().to_string() + ".");
  }
  const SignedMap difference = signed_map(*loaded, *reference);
  (difference.standard_errors ? kinds.standard_errors : kinds.relative) = true;
  return html + map_figure(name + (difference.standard_errors ? ": z" : ": relative difference"), view,
                           reduced(difference.map, factor), signed_palette(),
                           signed_caption(difference.standard_errors));
}

std::string scales(const MapKinds& kinds, const std::string& view) {
  std::string html;
  if (kinds.flip) html += palette_scale(flip_palette(), "flip-scale-" + view, "HDR-FLIP", "0", "0.5", "1");
  if (kinds.relative) {
    html += palette_scale(signed_palette(), "relative-scale-" + view,
                          "Relative difference of luminance, picture less reference", "−100 %", "0", "+100 %");
  }
  if (kinds.standard_errors) {
    html += palette_scale(signed_palette(), "z-scale-" + view,
                          "Difference of luminance in standard errors, picture less reference", "−5", "0", "+5");
  }
  return html;
}

// The exposure of a view: that of its reference, and without one that of the first picture there is.
double exposure_of(const Stage& stage, std::uint32_t view, const std::optional<LoadedPicture>& reference) {
  if (reference) return auto_exposure(reference->view());
  for (std::size_t mode = 0; mode < stage.data.modes(); ++mode) {
    const auto file = mode_file(stage.data, stage.folder, mode, view);
    if (!file) continue;
    if (const Result<LoadedPicture> loaded = load_picture(*file); loaded) return auto_exposure(loaded->view());
  }
  return 1;
}

std::string signed_stops(double exposure) {
  const double stops = std::log2(exposure);
  return fmt::format("{}{:.1f}", stops < 0 ? "−" : "+", std::abs(stops));
}

std::string view_part(const Stage& stage, std::uint32_t view) {
  std::optional<LoadedPicture> reference;
  std::string problem = "There is no picture of the reference, so there are no maps.";
  if (const auto file = reference_file(stage.data, stage.folder, view)) {
    Result<LoadedPicture> loaded = load_picture(*file);
    if (loaded)
      reference = *std::move(loaded);
    else
      problem = "The reference cannot be shown: " + loaded.error().message + ".";
  }
  const double exposure = exposure_of(stage, view, reference);
  const std::string id = std::to_string(view);
  std::string html = fmt::format(
      "<section class=\"view\" data-view=\"{}\" data-exposure=\"{:.9g}\"><h3>View {}</h3><p class=\"note\">"
      "Shown at an exposure of {} stops.</p><div class=\"pictures\">\n",
      view, exposure, view, signed_stops(exposure));
  if (reference) {
    html += radiance_figure("reference", view, reduced(*reference, stage.choice.factor), exposure,
                            "<strong>reference</strong>");
  } else {
    html += absent_figure(problem);
  }
  MapKinds kinds;
  std::string rows;
  for (std::size_t mode = 0; mode < stage.data.modes(); ++mode) {
    rows += "<div class=\"mode\">" + mode_row(stage, mode, view, reference, exposure, kinds) + "</div>";
  }
  return html + "<div class=\"scales\">" + scales(kinds, id) + "</div></div>\n<div class=\"modes\">" + rows +
         "</div>\n" + worst_pixels(stage.data, view) + "</section>\n";
}

std::string shown_note(const PictureChoice& choice) {
  std::string text = "<p>Of each mode the picture of the first seed and the last budget.";
  if (choice.views.size() < choice.views_with_pictures) {
    text += fmt::format(" {} of {} views are shown, to keep the page small.", choice.views.size(),
                        choice.views_with_pictures);
  }
  if (choice.factor > 1) {
    text += fmt::format(
        " To keep the page small, pictures and maps are reduced: each pixel is the mean of {0} × {0}, in which noise "
        "looks smaller than it is. Maps and figures are made of the full pictures.",
        choice.factor);
  }
  return text + "</p>\n";
}

}  // namespace

std::string picture_section(const ReportData& data, const fs::path& folder) {
  std::string html = "<section id=\"pictures\"><h2>Pictures</h2>\n";
  std::vector<std::uint32_t> views;
  std::optional<fs::path> first;
  for (std::uint32_t view = 0; view < std::uint32_t(std::max(1, data.request().views_size())); ++view) {
    std::optional<fs::path> found = reference_file(data, folder, view);
    for (std::size_t mode = 0; mode < data.modes() && !found; ++mode) found = mode_file(data, folder, mode, view);
    if (!found) continue;
    views.push_back(view);
    if (!first) first = found;
  }
  if (views.empty()) {
    return html + "<p>There are no pictures beside the record, so none are shown.</p>\n" +
           worst_pixels(data, std::nullopt) + "</section>\n";
  }
  const Result<LoadedPicture> sample = load_picture(*first);
  const std::uint64_t pixels = sample ? sample->view().pixels() : 1;
  const Stage stage{data, folder, choose_pictures(views, data.modes() + 1, pixels)};
  html += shown_note(stage.choice) + std::string(page_stage());
  for (const std::uint32_t view : stage.choice.views) html += view_part(stage, view);
  return html + "</section>\n";
}

}  // namespace helio::report
