// Spectra given as samples over wavelength, as linear sRGB colours.
#pragma once

#include <optional>
#include <string>

#include "renderer/scene/mitsuba_values.h"

namespace helio::mitsuba {

// "400:0.1, 500:0.7, ..." in nm, linear between the samples, 0 outside of them. Observer: the CIE 1931 colour matching
// functions in the analytic form of Wyman, Sloan and Shirley 2013 ("Simple Analytic Approximations to the CIE XYZ Color
// Matching Functions"), 360 to 830 nm. Emission: light of equal energy and value 1 has luminance Y = 1. Reflectance:
// per channel relative to that of a white surface, which is then white; within [0, 1]. Index: the mean over wavelengths
// weighted by each channel's matching function, the same rule as for reflectance without the upper limit.
// None: malformed, wavelengths not increasing, or a negative value.
std::optional<Rgb> spectrum_color(const std::string& text, SpectrumUse use);

}  // namespace helio::mitsuba
