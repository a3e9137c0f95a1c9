// The values of a plugin's properties: numbers, switches, texts, points, transforms and colours, each checked and
// marked as read.
#pragma once

#include <optional>

#include "renderer/scene/mitsuba/document.h"

namespace helio::mitsuba {

struct Range {
  double low = -1e30, high = 1e30;
  bool open_low = false;  // low itself is not allowed
};

// A plugin element and the things its properties are read with. Cheap to copy.
class Plugin {
 public:
  Plugin(const Element& element, const Document& document, Diagnostics& diagnostics)
      : element_(&element), document_(&document), diagnostics_(&diagnostics) {
    element.read = true;
  }

  const Element& element() const { return *element_; }
  const std::string& type() const { return element_->type; }
  const std::string& place() const { return element_->place; }
  std::string label() const { return element_->tag + " \"" + element_->type + "\""; }
  Diagnostics& diagnostics() const { return *diagnostics_; }
  Plugin other(const Element& element) const { return {element, *document_, *diagnostics_}; }

  // The child of that name, references followed; null where there is none.
  const Element* find(const char* name) const;
  bool has(const char* name) const { return find(name) != nullptr; }

  // Absent: `fallback`. A value of a wrong type or outside the range is reported and replaced by `fallback`.
  double number(const char* name, double fallback, const Range& range = {}) const;
  int integer(const char* name, int fallback, int low, int high) const;
  bool boolean(const char* name, bool fallback) const;
  std::string text(const char* name, const std::string& fallback) const;
  V3d vector(const char* name, const V3d& fallback) const;
  M44d transform(const char* name) const;  // identity where absent; row vectors, finite

  // Children of that tag, named or not, references followed: nested bsdfs, the emitter of a shape.
  std::vector<const Element*> children(const char* tag) const;

  void fail(std::string message, ErrorCode code = ErrorCode::invalid_argument) const {
    diagnostics_->fail(place(), label() + " " + message, code);
  }
  void warn(const std::string& message) const { diagnostics_->warn(place(), label() + " " + message); }

 private:
  const Element* element_;
  const Document* document_;
  Diagnostics* diagnostics_;
};

// Of ASCII: names that Mitsuba compares without regard to case.
std::string lower_case(std::string text);

// Numbers separated by blanks or commas; none when something else is among them, or one is not finite.
std::optional<std::vector<double>> parse_numbers(const std::string& text);

enum class SpectrumUse { reflectance, emission, index };

// The colour of an element <rgb>, <srgb>, <spectrum>, <float> or texture "uniform"; none when it is something else (a
// texture). Linear sRGB. Spectra go through the CIE 1931 observer (mitsuba/spectrum.h): emission of one value in
// <spectrum> is that of equal energy, in the others it is grey.
std::optional<Rgb> color_of(const Element& element, SpectrumUse use, Diagnostics& diagnostics);

// Lists as unread everything below `element` that nobody asked for: of plugins, only their names. What the scene itself
// defines with an id may go unread.
void report_unread(const Element& element, Diagnostics& diagnostics);

}  // namespace helio::mitsuba
