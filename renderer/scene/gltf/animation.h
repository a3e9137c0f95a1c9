// Animations (clips) at a moment (glTF 2.0, 3.11 and appendix C). A file's clips are alternatives: one of them plays.
#pragma once

#include <string>
#include <vector>

#include "renderer/scene/gltf/accessors.h"

namespace helio::gltf {

// Its name in the file, or "animation 3".
std::string animation_name(const Document& document, std::size_t index);
// Names of all but one, for people: the first 16, and how many more there are.
std::string list_animations(const Document& document, int without);

// The animation that is named so, or whose number that is in decimal. Empty: the first that moves anything, -1: none
// does. A failure when there is none such.
int choose_animation(const Document& document, const std::string& wanted, Diagnostics& diagnostics);

// Overwrites what animation `played` (-1: none) drives at time_s (seconds, clamped to each sampler's first and last
// key). The data of all is checked; failures name the accessor.
void apply_animation(const Document& document, int played, double time_s, AccessorReader& reader,
                     Diagnostics& diagnostics, std::vector<Trs>& trs, std::vector<std::vector<float>>& weights);

// Whether a quaternion of this length is a rotation but for rounding; a slip where it is off by more than that.
bool check_unit_rotation(const std::string& place, std::size_t index, double length, Diagnostics& diagnostics);

}  // namespace helio::gltf
