// The BSDFs of the shaders against those of trace/bsdf: the same random inputs, the same results up to rounding.
#include <gtest/gtest.h>

#include <helio_shaders/bsdf_queries_comp.h>

#include <algorithm>
#include <deque>
#include <map>
#include <span>
#include <sstream>

#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/scene/material_tables.h"
#include "tests/support/random.h"
#include "tests/unit/trace/bsdf/mitsuba_cases.h"
#include "tests/unit/vulkan/bsdf_queries.h"
#include "tests/unit/vulkan/scene_queries.h"
#include "tests/unit/vulkan/test_device.h"

namespace helio::test {
namespace {

using vulkan::BsdfAnswer;
using vulkan::BsdfQuery;

struct Case {
  SurfaceParams params;
  V3f wo, wi;
  float u_lobe = 0;
  V2f u;
};

// Random parameters, with the ends of their ranges more often than by chance.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : random_(seed) {}

  float unit() { return random_.next_float(); }
  bool chance(float probability) { return unit() < probability; }
  float share() { return chance(0.2f) ? 0.0f : chance(0.2f) ? 1.0f : unit(); }
  float alpha() {
    const float ends[] = {0, 0.99e-3f, 1.01e-3f, 0.01f, 1};
    return chance(0.3f) ? ends[int(unit() * 5)] : sqr(unit());
  }
  Rgb color() {
    if (chance(0.15f)) return Rgb(0);
    if (chance(0.15f)) return Rgb(1);
    return {unit(), unit(), unit()};
  }
  MicrofacetDistribution distribution() {
    return chance(0.5f) ? MicrofacetDistribution::ggx : MicrofacetDistribution::beckmann;
  }
  // Sometimes grazing, sometimes the normal itself.
  V3f direction(bool both_sides) {
    float z = unit();
    if (chance(0.15f)) z *= 1e-3f;
    if (chance(0.05f)) z = 1;
    const double phi = 2 * std::numbers::pi * unit(), sine = std::sqrt((1 - double(z)) * (1 + double(z)));
    return {float(sine * std::cos(phi)), float(sine * std::sin(phi)), both_sides && chance(0.5f) ? -z : z};
  }

 private:
  Random random_;
};

void make_anisotropic(Dice& dice, SurfaceParams& p) {
  const float angle = kTwoPi * dice.unit();
  p.distribution = p.distribution == MicrofacetDistribution::ggx ? MicrofacetDistribution::ggx_anisotropic
                                                                 : MicrofacetDistribution::beckmann_anisotropic;
  p.alpha_along = std::max(p.alpha, kDeltaAlpha);
  p.alpha_across = std::max(dice.alpha(), kDeltaAlpha);
  p.alpha = std::sqrt(p.alpha_along * p.alpha_across);
  p.along = V2f(std::cos(angle), std::sin(angle));
}

SurfaceParams random_base(Dice& dice, LobeModel model) {
  SurfaceParams p;
  p.model = model;
  p.distribution = dice.distribution();
  p.alpha = dice.alpha();
  p.base_color = dice.color();
  return p;
}

SurfaceParams random_lambert(Dice& dice) {
  return random_base(dice, LobeModel::lambert);
}

SurfaceParams random_metallic_roughness(Dice& dice) {
  SurfaceParams p = random_base(dice, LobeModel::metallic_roughness);
  const float iors[] = {1, 1.0005f, 0, 1.5f, 2.4f};
  p.metallic = dice.share();
  p.transmission = dice.share();
  p.thin = p.transmission == 0 || dice.chance(0.4f);
  p.ior = dice.chance(0.5f) ? iors[int(dice.unit() * 5)] : 1.01f + dice.unit();
  p.specular = dice.chance(0.5f) ? 1.0f : dice.share();
  if (dice.chance(0.4f)) p.specular_color = dice.color();
  p.tinted_reflection = dice.chance(0.2f);
  if (dice.chance(0.3f)) make_anisotropic(dice, p);
  return p;
}

SurfaceParams random_specular_glossiness(Dice& dice) {
  SurfaceParams p = random_base(dice, LobeModel::specular_glossiness);
  p.f0 = dice.color();
  return p;
}

SurfaceParams random_conductor(Dice& dice) {
  SurfaceParams p = random_base(dice, LobeModel::conductor);
  p.specular_color = dice.color();
  p.eta = dice.chance(0.1f) ? Rgb(0) : Rgb(4 * dice.unit(), 2 * dice.unit(), dice.unit());
  p.k = dice.chance(0.1f) ? Rgb(1) : Rgb(9 * dice.unit(), 4 * dice.unit(), dice.unit());
  if (dice.chance(0.4f)) make_anisotropic(dice, p);
  return p;
}

SurfaceParams random_plastic(Dice& dice) {
  static std::deque<SurfaceParams> interfaces;  // rough ones take a while to make
  if (interfaces.empty()) {
    for (int i = 0; i < 12; ++i) {
      const float alpha = i < 4 ? 0.0f : 0.02f + 0.1f * float(i - 4);
      interfaces.push_back(plastic(dice.distribution(), alpha, 1.2f + dice.unit(), Rgb(1), i % 2 == 1));
    }
  }
  SurfaceParams p = interfaces[std::size_t(dice.unit() * float(interfaces.size()))];
  p.base_color = dice.color();
  p.specular_color = dice.color();
  return p;
}

SurfaceParams random_pane(Dice& dice) {
  SurfaceParams p = random_base(dice, LobeModel::pane);
  p.ior = 1 + 1.5f * dice.unit();
  p.transmission = 1;
  p.specular_color = dice.color();
  return p;
}

SurfaceParams random_principled(Dice& dice) {
  SurfaceParams p = random_base(dice, LobeModel::principled);
  p.distribution = MicrofacetDistribution::ggx;
  p.alpha = std::max(p.alpha, kDeltaAlpha);
  p.metallic = dice.share();
  p.transmission = dice.share();
  p.thin = p.transmission == 0;
  p.ior = 1.001f + dice.unit();
  p.principled = {dice.share(), dice.share(), dice.share(), dice.share(), dice.share(), dice.share(), dice.share()};
  if (dice.chance(0.5f)) make_anisotropic(dice, p);
  return p;
}

using Generator = SurfaceParams (*)(Dice&);
constexpr Generator kModels[] = {
    random_lambert, random_metallic_roughness, random_specular_glossiness, random_conductor, random_plastic,
    random_pane,    random_principled};

void make_mapped(Dice& dice, SurfaceParams& p) {
  p.mapped = true;
  p.map_normal = (V3f(0, 0, 1) + V3f(dice.unit() - 0.5f, dice.unit() - 0.5f, 0)).normalized();
  p.map_alpha2 = dice.chance(0.5f) ? 0.0f : 0.1f * dice.unit();
}

SurfaceParams random_model(Dice& dice) {
  return kModels[std::size_t(dice.unit() * float(std::size(kModels)))](dice);
}

SurfaceParams random_mapped(Dice& dice) {
  SurfaceParams p = random_model(dice);
  make_mapped(dice, p);
  return p;
}

SurfaceParams random_blend(Dice& dice) {
  SurfaceParams first = random_model(dice), second = random_model(dice);
  if (dice.chance(0.3f)) make_mapped(dice, first);
  if (dice.chance(0.1f)) second.model = LobeModel::none;
  SurfaceParams p = blend(first, second, dice.share());
  if (dice.chance(0.3f)) make_mapped(dice, p);
  return p;
}

std::vector<Case> random_cases(Generator generator, int count, std::uint32_t seed) {
  Dice dice(seed);
  std::vector<Case> cases(static_cast<std::size_t>(count));
  for (Case& c : cases) {
    c.params = generator(dice);
    c.wo = dice.direction(true);
    c.u_lobe = dice.unit();
    c.u = V2f(dice.unit(), dice.unit());
    c.wi = dice.direction(true);
    // Every other direction near where the lobes are.
    if (dice.chance(0.5f)) {
      const BsdfSample sample = sample_bsdf(c.params, c.wo, dice.unit(), V2f(dice.unit(), dice.unit()));
      if (sample.valid()) c.wi = sample.wi;
    }
  }
  return cases;
}

enum class Kind : std::size_t {
  lambert,
  metallic_roughness,
  specular_glossiness,
  conductor,
  plastic,
  pane,
  principled,
  mapped,
  blend
};
constexpr Generator kGenerators[] = {random_lambert,
                                     random_metallic_roughness,
                                     random_specular_glossiness,
                                     random_conductor,
                                     random_plastic,
                                     random_pane,
                                     random_principled,
                                     random_mapped,
                                     random_blend};
constexpr int kCases = 1000;  // of a kind

// ---- on the device -------------------------------------------------------------------------------------------------

// Puts tables and cases on a device.
class Queries {
 public:
  explicit Queries(const std::shared_ptr<vulkan::Device>& device) : device_(device), arena_(device) {
    const Result<vulkan::BsdfTables> tables = vulkan::BsdfTables::place(arena_);
    EXPECT_TRUE(tables.ok());
    if (tables) tables_ = *tables;
  }

  // Empty after an error, which fails the test. `features`: what the shader is specialised by.
  std::vector<BsdfAnswer> ask(std::span<const Case> cases, std::uint32_t features = ~0u) {
    std::vector<BsdfQuery> queries;
    for (const Case& c : cases) queries.push_back(query_of(c));
    const std::uint32_t constants[] = {~0u, features};
    const auto answers = run_scene_queries<BsdfAnswer>(device_, bsdf_queries_comp, 0, queries, constants);
    EXPECT_TRUE(answers.ok()) << answers.error().to_string();
    return answers ? *answers : std::vector<BsdfAnswer>();
  }

 private:
  vulkan::LobeParams lobes_of(const SurfaceParams& params) {
    if (!params.plastic) return vulkan::make_lobe_params(params, tables_, 0);
    std::uint64_t& placed = plastics_[params.plastic];
    if (placed == 0) {
      const auto address = arena_.upload_value(vulkan::make_plastic_table(*params.plastic), "plastic tables");
      EXPECT_TRUE(address.ok());
      if (address) placed = *address;
    }
    return vulkan::make_lobe_params(params, tables_, placed);
  }

  BsdfQuery query_of(const Case& c) {
    BsdfQuery query{};
    const bool blend = c.params.model == LobeModel::blend;
    query.first = lobes_of(blend ? c.params.blend->first : c.params);
    query.second = lobes_of(blend ? c.params.blend->second : c.params);
    if (!blend) query.first.mapped = 0;
    query.model = std::uint32_t(c.params.model);
    query.transmission = c.params.transmission;
    query.mapped = c.params.mapped;
    query.map_normal = c.params.map_normal;
    query.map_alpha2 = c.params.map_alpha2;
    query.weight = blend ? c.params.blend->weight : 0.0f;
    query.wo = c.wo;
    query.wi = c.wi;
    query.u_lobe = c.u_lobe;
    query.u = c.u;
    return query;
  }

  std::shared_ptr<vulkan::Device> device_;
  vulkan::Arena arena_;
  vulkan::BsdfTables tables_;
  std::map<const PlasticInterface*, std::uint64_t> plastics_;
};

struct Answered {
  std::vector<Case> cases;
  std::vector<BsdfAnswer> answers;
};

// All kinds by one dispatch, made by the first test.
const Answered& answered(const std::shared_ptr<vulkan::Device>& device) {
  static Answered all = [&] {
    Answered result;
    std::uint32_t seed = 1;
    for (const Generator generator : kGenerators) {
      const std::vector<Case> cases = random_cases(generator, kCases, seed++);
      result.cases.insert(result.cases.end(), cases.begin(), cases.end());
    }
    result.answers = Queries(device).ask(result.cases);
    return result;
  }();
  return all;
}

// ---- comparison ----------------------------------------------------------------------------------------------------

// Rounding of a facet's normal by 2^-24 is one of 2^-24 / alpha in units of the width of the distribution, whose
// logarithm has slopes up to about 20 where it still matters.
float tolerance_of(const SurfaceParams& p) {
  if (p.model == LobeModel::blend) return std::max(tolerance_of(p.blend->first), tolerance_of(p.blend->second));
  float alpha = p.alpha;
  if (p.distribution == MicrofacetDistribution::ggx_anisotropic ||
      p.distribution == MicrofacetDistribution::beckmann_anisotropic)
    alpha = std::min({alpha, p.alpha_along, p.alpha_across});
  return alpha < kDeltaAlpha ? 1e-4f : 1e-4f + 1e-6f / alpha;
}

// Relative to the larger, or to 1e-6 where both are below that: tails of distributions, in which differences of numbers
// near 1 count. Infinite where one of the two is not finite and the other is not the same.
float difference(float a, float b) {
  if (a == b) return 0;
  const float d = std::fabs(a - b) / std::max({std::fabs(a), std::fabs(b), 1e-6f});
  return std::isfinite(d) ? d : std::numeric_limits<float>::infinity();
}
// Relative to the largest channel.
float difference(const Rgb& a, const Rgb& b) {
  const auto largest = [](const Rgb& c) { return std::max({std::fabs(c.x), std::fabs(c.y), std::fabs(c.z)}); };
  if (a == b) return 0;
  if (!is_finite(a) || !is_finite(b)) return std::numeric_limits<float>::infinity();
  return largest(a - b) / std::max({largest(a), largest(b), 1e-6f});
}

// Of samples: 1 where they are of different kinds, else the largest of what differs.
float difference(const BsdfSample& own, const BsdfAnswer& answer) {
  const bool valid = answer.sampled_pdf_w > 0;
  if (own.valid() != valid) return 1;
  if (!valid) return 0;
  if (own.delta != (answer.delta != 0) || own.transmitted != (answer.transmitted != 0)) return 1;
  return std::max({difference(own.wi, answer.wi), difference(own.weight, answer.weight),
                   difference(own.pdf_w, answer.sampled_pdf_w), difference(own.eta, answer.eta)});
}

struct Differences {
  float value = 0, sample = 0;
};

// An input may lie so near a decision (which lobe, reflection or refraction, above the horizon or below) that rounding
// takes it. Then the CPU gives the device's sample for variates that differ from the case's by a few units of rounding.
constexpr int kMostOnBranches = 3;
bool on_a_branch(const Case& c, const BsdfAnswer& answer, float tolerance) {
  constexpr float kStep = 1e-6f;
  for (const float lobe : {-kStep, 0.0f, kStep}) {
    for (const float x : {-kStep, 0.0f, kStep}) {
      for (const float y : {-kStep, 0.0f, kStep}) {
        const auto moved = [](float u, float by) { return std::clamp(u + by, 0.0f, kOneMinusEpsilon); };
        const BsdfSample sample =
            sample_bsdf(c.params, c.wo, moved(c.u_lobe, lobe), V2f(moved(c.u.x, x), moved(c.u.y, y)));
        if (difference(sample, answer) <= 10 * tolerance) return true;
      }
    }
  }
  return false;
}

std::string describe(const Case& c) {
  const SurfaceParams& p = c.params;
  std::ostringstream text;
  text.precision(9);
  text << "model " << int(p.model) << " distribution " << int(p.distribution) << " thin " << p.thin << " alpha "
       << p.alpha << " (" << p.alpha_along << ", " << p.alpha_across << ") base " << p.base_color << " metallic "
       << p.metallic << " transmission " << p.transmission << " ior " << p.ior << " specular " << p.specular << " wo "
       << c.wo << " wi " << c.wi << " u_lobe " << c.u_lobe << " u " << c.u;
  return text.str();
}

// What material_features() would say of a scene with these.
std::uint32_t features_of(const SurfaceParams& p) {
  std::uint32_t features = 1u << std::uint32_t(p.model);
  if (p.model == LobeModel::blend) features |= features_of(p.blend->first) | features_of(p.blend->second);
  if (p.mapped) features |= vulkan::kFeatureScatterMaps;
  if (is_anisotropic(p.distribution)) features |= vulkan::kFeatureAnisotropy;
  if (p.distribution == MicrofacetDistribution::beckmann ||
      p.distribution == MicrofacetDistribution::beckmann_anisotropic)
    features |= vulkan::kFeatureBeckmann;
  if (p.transmission > 0) features |= vulkan::kFeatureTransmission;
  return features;
}

class BsdfAgreement : public DeviceTest {
 protected:
  void compare(Kind kind) {
    const Answered& all = answered(device());
    ASSERT_EQ(all.answers.size(), all.cases.size());
    Differences most;
    int on_branches = 0, sampled = 0;
    const std::size_t begin = std::size_t(kind) * kCases;
    for (std::size_t i = begin; i < begin + kCases; ++i) {
      const Case& c = all.cases[i];
      const BsdfAnswer& answer = all.answers[i];
      const float tolerance = tolerance_of(c.params);
      const BsdfValue value = evaluate_bsdf(c.params, c.wo, c.wi);
      const Rgb albedo = surface_albedo(c.params, c.wo);
      const float f_cos = difference(value.f_cos, answer.f_cos), pdf = difference(value.pdf_w, answer.pdf_w);
      EXPECT_LE(f_cos, tolerance) << value.f_cos << ", device " << answer.f_cos << "\n" << describe(c);
      EXPECT_LE(pdf, tolerance) << value.pdf_w << ", device " << answer.pdf_w << "\n" << describe(c);
      EXPECT_LE(difference(albedo, answer.albedo), 1e-4f) << albedo << ", device " << answer.albedo << "\n"
                                                          << describe(c);
      EXPECT_EQ(is_pure_delta(c.params), answer.pure_delta != 0) << describe(c);
      most.value = std::max({most.value, f_cos, pdf});

      const BsdfSample sample = sample_bsdf(c.params, c.wo, c.u_lobe, c.u);
      const float distance = difference(sample, answer);
      sampled += sample.valid();
      if (distance <= tolerance) {
        most.sample = std::max(most.sample, distance);
        continue;
      }
      ++on_branches;
      EXPECT_TRUE(on_a_branch(c, answer, tolerance))
          << "wi " << sample.wi << " weight " << sample.weight << " pdf " << sample.pdf_w << " delta " << sample.delta
          << ", device " << answer.wi << " weight " << answer.weight << " pdf " << answer.sampled_pdf_w << " delta "
          << answer.delta << "\n"
          << describe(c);
    }
    EXPECT_LE(on_branches, kMostOnBranches);
    EXPECT_GE(sampled, kCases / 3);
    RecordProperty("largest_difference_of_values", std::to_string(most.value));
    RecordProperty("largest_difference_of_samples", std::to_string(most.sample));
    RecordProperty("on_branches", on_branches);
  }
};

TEST_F(BsdfAgreement, Lambert) {
  compare(Kind::lambert);
}
TEST_F(BsdfAgreement, MetallicRoughness) {
  compare(Kind::metallic_roughness);
}
TEST_F(BsdfAgreement, SpecularGlossiness) {
  compare(Kind::specular_glossiness);
}
TEST_F(BsdfAgreement, Conductor) {
  compare(Kind::conductor);
}
TEST_F(BsdfAgreement, Plastic) {
  compare(Kind::plastic);
}
TEST_F(BsdfAgreement, Pane) {
  compare(Kind::pane);
}
TEST_F(BsdfAgreement, Principled) {
  compare(Kind::principled);
}
TEST_F(BsdfAgreement, MappedNormals) {
  compare(Kind::mapped);
}
TEST_F(BsdfAgreement, Blend) {
  compare(Kind::blend);
}

// Shaders that have the code for some features alone.
TEST_F(BsdfAgreement, SpecialisedShadersGiveTheSame) {
  const Answered& all = answered(device());
  ASSERT_EQ(all.answers.size(), all.cases.size());
  // By the features that the cases of a set need, each of another model.
  std::map<std::uint32_t, std::vector<std::size_t>> sets;
  for (std::size_t i = 0; i < all.cases.size(); ++i) {
    const std::uint32_t features = features_of(all.cases[i].params);
    for (const std::uint32_t set :
         {1u << vulkan::kLobeLambert, 1u << vulkan::kLobeMetallicRoughness,
          1u << vulkan::kLobeConductor | vulkan::kFeatureBeckmann | vulkan::kFeatureScatterMaps,
          1u << vulkan::kLobePrincipled | vulkan::kFeatureAnisotropy | vulkan::kFeatureTransmission}) {
      if ((features & ~set) == 0) sets[set].push_back(i);
    }
  }
  EXPECT_EQ(sets.size(), 4u);
  for (const auto& [features, members] : sets) {
    EXPECT_GT(members.size(), 50u) << features;
    std::vector<Case> cases;
    for (const std::size_t i : members) cases.push_back(all.cases[i]);
    const std::vector<BsdfAnswer> answers = Queries(device()).ask(cases, features);
    ASSERT_EQ(answers.size(), cases.size());
    for (std::size_t k = 0; k < cases.size(); ++k) {
      const BsdfAnswer &general = all.answers[members[k]], &special = answers[k];
      const float tolerance = tolerance_of(cases[k].params);
      EXPECT_LE(difference(general.f_cos, special.f_cos), tolerance) << features << " " << describe(cases[k]);
      EXPECT_LE(difference(general.pdf_w, special.pdf_w), tolerance) << features << " " << describe(cases[k]);
      EXPECT_LE(difference(general.albedo, special.albedo), tolerance) << features << " " << describe(cases[k]);
      EXPECT_LE(difference(general.weight, special.weight), tolerance) << features << " " << describe(cases[k]);
      EXPECT_LE(difference(general.wi, special.wi), tolerance) << features << " " << describe(cases[k]);
      EXPECT_EQ(general.pure_delta, special.pure_delta) << features << " " << describe(cases[k]);
    }
  }
}

}  // namespace
}  // namespace helio::test
