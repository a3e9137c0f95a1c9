#include "renderer/scene/mitsuba_indices.h"

namespace helio::mitsuba {

namespace {

struct NamedIor {
  const char* name;
  double ior;
};
constexpr NamedIor kIors[] = {
    {"vacuum", 1.0},         {"helium", 1.000036},         {"hydrogen", 1.000132},
    {"air", 1.000277},       {"carbon dioxide", 1.00045},  {"water", 1.3330},
    {"acetone", 1.36},       {"ethanol", 1.361},           {"carbon tetrachloride", 1.461},
    {"glycerol", 1.4729},    {"benzene", 1.501},           {"silicone oil", 1.52045},
    {"bromine", 1.661},      {"water ice", 1.31},          {"fused quartz", 1.458},
    {"pyrex", 1.470},        {"acrylic glass", 1.49},      {"polypropylene", 1.49},
    {"bk7", 1.5046},         {"sodium chloride", 1.544},   {"amber", 1.55},
    {"pet", 1.5750},         {"diamond", 2.419},
};

struct NamedMetal {
  const char* name;
  ComplexIndex index;
};
const NamedMetal kMetals[] = {
    {"none", {Rgb(0, 0, 0), Rgb(1, 1, 1)}},
    {"Ag", {Rgb(0.155f, 0.117f, 0.138f), Rgb(4.828f, 3.122f, 2.147f)}},
    {"Al", {Rgb(1.657f, 0.880f, 0.521f), Rgb(9.224f, 6.270f, 4.837f)}},
    {"Au", {Rgb(0.143f, 0.375f, 1.442f), Rgb(3.983f, 2.386f, 1.603f)}},
    {"Cr", {Rgb(4.369f, 2.917f, 1.655f), Rgb(5.207f, 4.231f, 3.755f)}},
    {"Cu", {Rgb(0.200f, 0.924f, 1.102f), Rgb(3.912f, 2.452f, 2.142f)}},
    {"W", {Rgb(4.371f, 3.307f, 2.998f), Rgb(3.501f, 2.604f, 2.273f)}},
};

template <class Table>
std::string names_of(const Table& table) {
  std::string names;
  for (const auto& entry : table) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return names;
}

}  // namespace

double read_ior(const Plugin& plugin, const char* name, double fallback) {
  const Element* element = plugin.find(name);
  if (!element || element->tag != "string") return plugin.number(name, fallback, {0, 100, true});
  const std::string material = plugin.text(name, "");
  for (const NamedIor& known : kIors)
    if (material == known.name) return known.ior;
  plugin.fail(std::string("has ") + name + " \"" + material + "\", allowed: a number or one of " + names_of(kIors));
  return fallback;
}

ComplexIndex metal_index(const Plugin& plugin, const std::string& name) {
  for (const NamedMetal& known : kMetals)
    if (name == known.name) return known.index;
  plugin.fail("has the material \"" + name + "\", allowed: " + names_of(kMetals) + "; or give eta and k",
              ErrorCode::unimplemented);
  return kMetals[0].index;
}

}  // namespace helio::mitsuba
