// Spectra given as samples over wavelength, as linear sRGB colours.
#pragma once

#include <optional>
#include <string>

#include "renderer/scene/mitsuba/values.h"

namespace helio::mitsuba {

// "400:0.1, 500:0.7, ..." in nm, linear between the samples, 0 outside of them, seen by the observer of cie_1931.h.
// Emission: light of equal energy and value 1 has luminance Y = 1: (1.205, 0.948, 0.909). Reflectance: under the
// illuminant D65, per channel relative to that of a white surface, which is then white; within [0, 1]. Index: as
// reflectance, without the upper limit. None: malformed, wavelengths not increasing, or a negative value.
std::optional<Rgb> spectrum_color(const std::string& text, SpectrumUse use);

// Light of equal energy, Y = 1: what emission of one value at all wavelengths is a multiple of.
Rgb equal_energy_white();

}  // namespace helio::mitsuba
