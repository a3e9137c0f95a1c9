#include "renderer/scene/mitsuba/indices.h"

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
// Spectra of the tables that Mitsuba brings (Palik; the SOPRA data base), as it turns them into colours.
const NamedMetal kMetals[] = {
    {"none", {Rgb(0, 0, 0), Rgb(1, 1, 1)}},
    {"a-C", {Rgb(2.944f, 2.2271f, 1.9682f), Rgb(0.88746f, 0.7993f, 0.81529f)}},
    {"Ag", {Rgb(0.15528f, 0.11673f, 0.13839f), Rgb(4.8284f, 3.1222f, 2.1469f)}},
    {"Al", {Rgb(1.6575f, 0.8804f, 0.52124f), Rgb(9.2238f, 6.2695f, 4.837f)}},
    {"AlAs", {Rgb(3.6053f, 3.2329f, 2.2163f), Rgb(0.00067944f, 0.0f, 0.0075127f)}},
    {"AlAs_palik", {Rgb(3.6053f, 3.2329f, 2.2163f), Rgb(0.00067944f, 0.0f, 0.0075127f)}},
    {"AlSb", {Rgb(0.0f, 4.1394f, 4.6693f), Rgb(0.0f, 0.094009f, 1.3006f)}},
    {"AlSb_palik", {Rgb(0.0f, 4.1394f, 4.6693f), Rgb(0.0f, 0.094009f, 1.3006f)}},
    {"Au", {Rgb(0.14304f, 0.37531f, 1.442f), Rgb(3.983f, 2.3856f, 1.6034f)}},
    {"Be", {Rgb(4.185f, 3.185f, 2.7841f), Rgb(3.8355f, 3.0101f, 2.869f)}},
    {"Be_palik", {Rgb(4.185f, 3.185f, 2.7841f), Rgb(3.8355f, 3.0101f, 2.869f)}},
    {"Cr", {Rgb(4.3697f, 2.9165f, 1.6549f), Rgb(5.2065f, 4.2313f, 3.7547f)}},
    {"CsI", {Rgb(2.1449f, 1.7023f, 1.6624f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"CsI_palik", {Rgb(2.1449f, 1.7023f, 1.6624f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"Cu", {Rgb(0.20101f, 0.92375f, 1.1022f), Rgb(3.9133f, 2.453f, 2.1421f)}},
    {"Cu2O", {Rgb(3.5518f, 2.9499f, 2.7519f), Rgb(0.11421f, 0.1939f, 0.60613f)}},
    {"Cu2O_palik", {Rgb(3.5518f, 2.9499f, 2.7519f), Rgb(0.11421f, 0.1939f, 0.60613f)}},
    {"Cu_palik", {Rgb(0.21323f, 0.91972f, 1.1024f), Rgb(3.9219f, 2.4573f, 2.1366f)}},
    {"CuO", {Rgb(3.2475f, 2.4478f, 2.2102f), Rgb(0.52109f, 0.57003f, 0.72218f)}},
    {"CuO_palik", {Rgb(3.2475f, 2.4478f, 2.2102f), Rgb(0.52109f, 0.57003f, 0.72218f)}},
    {"d-C", {Rgb(2.7087f, 2.3188f, 2.2289f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"d-C_palik", {Rgb(2.7087f, 2.3188f, 2.2289f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"Hg", {Rgb(2.3989f, 1.44f, 0.90957f), Rgb(6.3276f, 4.3719f, 3.4218f)}},
    {"Hg_palik", {Rgb(2.3989f, 1.44f, 0.90957f), Rgb(6.3276f, 4.3719f, 3.4218f)}},
    {"HgTe", {Rgb(4.779f, 3.2312f, 2.6599f), Rgb(1.6316f, 1.5808f, 1.7293f)}},
    {"HgTe_palik", {Rgb(4.779f, 3.2312f, 2.6599f), Rgb(1.6316f, 1.5808f, 1.7293f)}},
    {"Ir", {Rgb(3.0863f, 2.0822f, 1.6179f), Rgb(5.5922f, 4.0671f, 3.2673f)}},
    {"Ir_palik", {Rgb(3.0863f, 2.0822f, 1.6179f), Rgb(5.5922f, 4.0671f, 3.2673f)}},
    {"K", {Rgb(0.064043f, 0.04641f, 0.038185f), Rgb(2.1042f, 1.3489f, 0.91313f)}},
    {"K_palik", {Rgb(0.064043f, 0.04641f, 0.038185f), Rgb(2.1042f, 1.3489f, 0.91313f)}},
    {"Li", {Rgb(0.26579f, 0.19562f, 0.22095f), Rgb(3.5402f, 2.3111f, 1.6686f)}},
    {"Li_palik", {Rgb(0.26579f, 0.19562f, 0.22095f), Rgb(3.5402f, 2.3111f, 1.6686f)}},
    {"MgO", {Rgb(2.0896f, 1.6507f, 1.5949f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"MgO_palik", {Rgb(2.0896f, 1.6507f, 1.5949f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"Mo", {Rgb(4.484f, 3.5251f, 2.7763f), Rgb(4.1114f, 3.4208f, 3.1506f)}},
    {"Mo_palik", {Rgb(4.484f, 3.5251f, 2.7763f), Rgb(4.1114f, 3.4208f, 3.1506f)}},
    {"Na_palik", {Rgb(0.060269f, 0.056141f, 0.061988f), Rgb(3.1793f, 2.1125f, 1.579f)}},
    {"Nb", {Rgb(3.4201f, 2.7901f, 2.3956f), Rgb(3.4414f, 2.7377f, 2.5797f)}},
    {"Nb_palik", {Rgb(3.4201f, 2.7901f, 2.3956f), Rgb(3.4414f, 2.7377f, 2.5797f)}},
    {"Ni_palik", {Rgb(2.3673f, 1.6634f, 1.4671f), Rgb(4.4988f, 3.0502f, 2.3454f)}},
    {"Rh", {Rgb(2.5858f, 1.8602f, 1.5543f), Rgb(6.7823f, 4.703f, 3.9761f)}},
    {"Rh_palik", {Rgb(2.5858f, 1.8602f, 1.5543f), Rgb(6.7823f, 4.703f, 3.9761f)}},
    {"Se", {Rgb(4.0583f, 2.8429f, 2.8209f), Rgb(0.75405f, 0.63844f, 0.52181f)}},
    {"Se-e", {Rgb(5.7228f, 4.1657f, 4.0813f), Rgb(0.87114f, 1.1052f, 1.5653f)}},
    {"Se-e_palik", {Rgb(5.7228f, 4.1657f, 4.0813f), Rgb(0.87114f, 1.1052f, 1.5653f)}},
    {"Se_palik", {Rgb(4.0583f, 2.8429f, 2.8209f), Rgb(0.75405f, 0.63844f, 0.52181f)}},
    {"SiC", {Rgb(3.1723f, 2.526f, 2.4794f), Rgb(0.0f, 0.0f, 1.0193e-05f)}},
    {"SiC_palik", {Rgb(3.1723f, 2.526f, 2.4794f), Rgb(0.0f, 0.0f, 1.0193e-05f)}},
    {"SnTe", {Rgb(4.5242f, 1.9816f, 1.2816f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"SnTe_palik", {Rgb(4.5242f, 1.9816f, 1.2816f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"Ta", {Rgb(2.0627f, 2.3929f, 2.6279f), Rgb(2.4084f, 1.7415f, 1.947f)}},
    {"Ta_palik", {Rgb(2.0627f, 2.3929f, 2.6279f), Rgb(2.4084f, 1.7415f, 1.947f)}},
    {"Te", {Rgb(7.3902f, 4.4821f, 2.6371f), Rgb(3.256f, 3.5271f, 3.2921f)}},
    {"Te-e", {Rgb(7.5089f, 4.2964f, 2.37f), Rgb(5.5839f, 4.9472f, 3.9976f)}},
    {"Te-e_palik", {Rgb(7.5089f, 4.2964f, 2.37f), Rgb(5.5839f, 4.9472f, 3.9976f)}},
    {"Te_palik", {Rgb(7.3902f, 4.4821f, 2.6371f), Rgb(3.256f, 3.5271f, 3.2921f)}},
    {"ThF4", {Rgb(1.8307f, 1.4422f, 1.3876f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"ThF4_palik", {Rgb(1.8307f, 1.4422f, 1.3876f), Rgb(0.0f, 0.0f, 0.0f)}},
    {"TiC", {Rgb(3.7005f, 2.8374f, 2.5823f), Rgb(3.2656f, 2.3516f, 2.1728f)}},
    {"TiC_palik", {Rgb(3.7005f, 2.8374f, 2.5823f), Rgb(3.2656f, 2.3516f, 2.1728f)}},
    {"TiN", {Rgb(1.6484f, 1.1505f, 1.3798f), Rgb(3.3683f, 1.9435f, 1.1021f)}},
    {"TiN_palik", {Rgb(1.6484f, 1.1505f, 1.3798f), Rgb(3.3683f, 1.9435f, 1.1021f)}},
    {"TiO2", {Rgb(3.4566f, 2.8017f, 2.9052f), Rgb(0.00010526f, 0.0f, 0.00065289f)}},
    {"TiO2-e", {Rgb(3.1066f, 2.5132f, 2.5824f), Rgb(2.9752e-05f, 0.0f, 0.0001827f)}},
    {"TiO2-e_palik", {Rgb(3.1066f, 2.5132f, 2.5824f), Rgb(2.9752e-05f, 0.0f, 0.0001827f)}},
    {"TiO2_palik", {Rgb(3.4566f, 2.8017f, 2.9052f), Rgb(0.00010526f, 0.0f, 0.00065289f)}},
    {"V_palik", {Rgb(4.2776f, 3.5129f, 2.7611f), Rgb(3.4913f, 2.8895f, 3.1115f)}},
    {"VC", {Rgb(3.6576f, 2.7527f, 2.5327f), Rgb(3.0683f, 2.1987f, 1.9632f)}},
    {"VC_palik", {Rgb(3.6576f, 2.7527f, 2.5327f), Rgb(3.0683f, 2.1987f, 1.9632f)}},
    {"VN", {Rgb(2.8656f, 2.1192f, 1.9401f), Rgb(3.0322f, 2.0561f, 1.6163f)}},
    {"VN_palik", {Rgb(2.8656f, 2.1192f, 1.9401f), Rgb(3.0322f, 2.0561f, 1.6163f)}},
    {"W", {Rgb(4.3708f, 3.3002f, 2.9984f), Rgb(3.5006f, 2.6049f, 2.2732f)}},
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
  const std::string material = lower_case(plugin.text(name, ""));
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
