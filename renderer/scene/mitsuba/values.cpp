#include "renderer/scene/mitsuba/values.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <cstdlib>

#include "renderer/scene/images/texture.h"
#include "renderer/scene/mitsuba/spectrum.h"
#include "renderer/scene/mitsuba/transform.h"

namespace helio::mitsuba {

std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return text;
}

std::optional<std::vector<double>> parse_numbers(const std::string& text) {
  std::vector<double> numbers;
  const char* at = text.c_str();
  for (;;) {
    while (*at == ' ' || *at == ',' || *at == '\t' || *at == '\n' || *at == '\r') ++at;
    if (*at == 0) return numbers;
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at || !std::isfinite(value)) return std::nullopt;
    numbers.push_back(value);
    at = end;
  }
}

const Element* Plugin::find(const char* name) const {
  for (const Element& child : element_->children) {
    if (child.name != name) continue;
    child.read = true;
    if (child.tag != "ref") return &child;
    const auto found = document_->ids.find(child.id);
    if (found != document_->ids.end()) return found->second;
    diagnostics_->fail(child.place, "refers to \"" + child.id + "\", which no element has as its id");
    return nullptr;
  }
  return nullptr;
}

std::vector<const Element*> Plugin::children(const char* tag) const {
  std::vector<const Element*> found;
  for (const Element& child : element_->children) {
    const Element* target = &child;
    if (child.tag == "ref") {
      const auto known = document_->ids.find(child.id);
      if (known == document_->ids.end()) {
        child.read = true;
        diagnostics_->fail(child.place, "refers to \"" + child.id + "\", which no element has as its id");
        continue;
      }
      target = known->second;
    }
    if (target->tag != tag) continue;
    child.read = true;
    found.push_back(target);
  }
  return found;
}

double Plugin::number(const char* name, double fallback, const Range& range) const {
  const Element* e = find(name);
  if (!e) return fallback;
  const auto values = parse_numbers(e->attribute("value"));
  const bool is_number = e->tag == "float" || e->tag == "integer";
  if (!is_number || !values || values->size() != 1) {
    diagnostics_->fail(e->place, fmt::format("{} of {} is <{} value=\"{}\">, allowed: a <float>", name, label(), e->tag,
                                             e->attribute("value")));
    return fallback;
  }
  const double v = values->front();
  if (v >= range.low && v <= range.high && !(range.open_low && v == range.low)) return v;
  diagnostics_->fail(e->place, fmt::format("{} of {} is {}, allowed: {} {} to {}", name, label(), v,
                                           range.open_low ? "above" : "from", range.low, range.high));
  return fallback;
}

int Plugin::integer(const char* name, int fallback, int low, int high) const {
  return int(number(name, fallback, {double(low), double(high)}));
}

bool Plugin::boolean(const char* name, bool fallback) const {
  const Element* e = find(name);
  if (!e) return fallback;
  const std::string value = lower_case(e->attribute("value"));
  if (e->tag == "boolean" && (value == "true" || value == "false")) return value == "true";
  diagnostics_->fail(e->place, fmt::format("{} of {} is <{} value=\"{}\">, allowed: <boolean> true or false", name,
                                           label(), e->tag, e->attribute("value")));
  return fallback;
}

std::string Plugin::text(const char* name, const std::string& fallback) const {
  const Element* e = find(name);
  if (!e) return fallback;
  if (e->tag == "string") return e->attribute("value");
  diagnostics_->fail(e->place, fmt::format("{} of {} is a <{}>, allowed: a <string>", name, label(), e->tag));
  return fallback;
}

V3d Plugin::vector(const char* name, const V3d& fallback) const {
  const Element* e = find(name);
  if (!e) return fallback;
  if (e->tag == "point" || e->tag == "vector") {
    if (const auto v = vector_of(*e, 0)) return *v;
  }
  diagnostics_->fail(e->place, fmt::format("{} of {} is not a <point> or <vector> of three finite numbers", name,
                                           label()));
  return fallback;
}

M44d Plugin::transform(const char* name) const {
  const Element* e = find(name);
  if (!e) return M44d();
  if (e->tag != "transform") {
    diagnostics_->fail(e->place, fmt::format("{} of {} is a <{}>, allowed: a <transform>", name, label(), e->tag));
    return M44d();
  }
  return read_transform(*e, *diagnostics_);
}

std::optional<Rgb> color_of(const Element& e, SpectrumUse use, Diagnostics& diagnostics) {
  e.read = true;
  const std::string& value = e.attribute("value");
  const auto refuse = [&](const char* allowed) {
    diagnostics.fail(e.place, fmt::format("<{}> {} is \"{}\", allowed: {}", e.tag, e.name, value, allowed));
    return Rgb(0, 0, 0);
  };
  if (e.tag == "spectrum" && (value.find(':') != std::string::npos || value.empty())) {
    if (!e.attribute("filename").empty()) return refuse("values in the scene file; spectrum files are not read");
    const auto color = spectrum_color(value, use);
    return color ? *color : refuse("WAVELENGTH:VALUE pairs, wavelengths in nm that grow");
  }
  if (e.tag != "rgb" && e.tag != "srgb" && e.tag != "spectrum" && e.tag != "float") return std::nullopt;
  if (e.tag != "float" && value.size() == 7 && value[0] == '#') {
    char* end = nullptr;
    const long hex = std::strtol(value.c_str() + 1, &end, 16);
    if (*end) return refuse("#rrggbb");
    return Rgb(srgb_to_linear(float(hex >> 16 & 255) / 255), srgb_to_linear(float(hex >> 8 & 255) / 255),
               srgb_to_linear(float(hex & 255) / 255));
  }
  const auto v = parse_numbers(value);
  if (!v || (v->size() != 1 && v->size() != 3)) return refuse("one finite number or three");
  Rgb color = v->size() == 1 ? Rgb(float((*v)[0])) : Rgb(float((*v)[0]), float((*v)[1]), float((*v)[2]));
  if (e.tag == "spectrum" && v->size() == 1 && use == SpectrumUse::emission) color *= equal_energy_white();
  if (e.tag == "srgb") color = Rgb(srgb_to_linear(color.x), srgb_to_linear(color.y), srgb_to_linear(color.z));
  const float most = use == SpectrumUse::reflectance ? 1.0f : 1e30f;
  for (int c = 0; c < 3; ++c)
    if (!(color[c] >= 0 && color[c] <= most))
      return refuse(use == SpectrumUse::reflectance ? "values in [0, 1]" : "values in [0, 1e30]");
  return color;
}

void report_unread(const Element& element, Diagnostics& diagnostics) {
  // Children of the scene that have an id define something for others to refer to, or not.
  const bool defines = element.tag == "scene";
  for (const Element& child : element.children) {
    const std::string what =
        "<" + child.tag + ">" + (child.name.empty() ? child.type.empty() ? "" : " " + child.type : " " + child.name);
    if (child.read)
      report_unread(child, diagnostics);
    else if (!defines || child.id.empty() || child.tag == "ref")
      diagnostics.unread(child.place + ": " + what);
  }
}

}  // namespace helio::mitsuba
