#include "renderer/vulkan/scene/material_tables.h"

#include <algorithm>

#include "renderer/base/check.h"
#include "renderer/scene/description/material_slots.h"
#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/bsdf_plastic.h"
#include "renderer/trace/bsdf/microfacet_albedo.h"
#include "renderer/vulkan/scene/texture_tables.h"

namespace helio::vulkan {
namespace {

constexpr std::uint64_t kAlignment = 16;

template <class Enum>
constexpr bool same(Enum value, std::uint32_t constant) {
  return std::uint32_t(value) == constant;
}
static_assert(same(LobeModel::lambert, kLobeLambert) && same(LobeModel::metallic_roughness, kLobeMetallicRoughness) &&
              same(LobeModel::specular_glossiness, kLobeSpecularGlossiness) &&
              same(LobeModel::conductor, kLobeConductor) && same(LobeModel::stack, kLobeStack) &&
              same(LobeModel::plastic, kLobePlastic) && same(LobeModel::pane, kLobePane) &&
              same(LobeModel::principled, kLobePrincipled) && same(LobeModel::blend, kLobeBlend) &&
              same(LobeModel::none, kLobeNone));
static_assert(same(MicrofacetDistribution::ggx, kGgx) && same(MicrofacetDistribution::beckmann, kBeckmann) &&
              same(MicrofacetDistribution::ggx_anisotropic, kGgxAnisotropic) &&
              same(MicrofacetDistribution::beckmann_anisotropic, kBeckmannAnisotropic));
static_assert(same(MapRule::bend, kMapBend) && same(MapRule::own_frame, kMapOwnFrame) &&
              same(MapRule::own_frame_unflipped, kMapOwnFrameUnflipped));
static_assert(same(AlphaMode::opaque, kAlphaOpaque) && same(AlphaMode::mask, kAlphaMask) &&
              same(AlphaMode::blend, kAlphaBlend));
static_assert(PlasticInterface::kNodes == int(kPlasticNodes));

std::unique_ptr<AlbedoTable> make_albedo_table(MicrofacetDistribution distribution) {
  const AlbedoTableView view = albedo_table(distribution);
  HELIO_CHECK(view.mu_nodes == kAlbedoMuNodes && view.mean.size() == kAlbedoAlphaNodes &&
              view.directional.size() == std::size_t(kAlbedoMuNodes) * kAlbedoAlphaNodes &&
              view.lost_below.size() == view.directional.size());
  const auto terms = [](const AlbedoTerms& t) { return vec4(t.a, t.b, t.s, t.loss); };
  auto table = std::make_unique<AlbedoTable>();
  std::transform(view.directional.begin(), view.directional.end(), table->directional, terms);
  std::transform(view.mean.begin(), view.mean.end(), table->mean, terms);
  std::copy(view.lost_below.begin(), view.lost_below.end(), table->lost_below);
  return table;
}

bool is_beckmann(MicrofacetDistribution distribution) {
  return distribution == MicrofacetDistribution::beckmann ||
         distribution == MicrofacetDistribution::beckmann_anisotropic;
}

std::uint32_t flags_of(const Material& m, const MaterialRecord& r) {
  const auto bit = [](bool set, std::uint32_t flag) { return set ? flag : 0u; };
  return bit(r.numbers_textured, kMaterialNumbersTextured) | bit(r.normal_mapped, kMaterialNormalMapped) |
         bit(r.scatters_mapped, kMaterialScattersMapped) | bit(r.specular, kMaterialSpecular) |
         bit(r.emissive, kMaterialEmissive) | bit(r.double_sided, kMaterialDoubleSided) |
         bit(r.one_sided, kMaterialOneSided) | bit(r.volume, kMaterialVolume) | bit(r.unlit, kMaterialUnlit) |
         bit(r.pure_delta, kMaterialPureDelta) | bit(m.map_shadowing, kMaterialMapShadowing) |
         bit(m.map_mirrored, kMaterialMapMirrored) | bit(m.blend.by_side, kMaterialBlendBySide);
}

void set_textures(const Material& m, MaterialTable& table) {
  const NumberTextures& numbers = m.numbers;
  const auto set = [&](std::uint32_t i, const TextureSlot& slot) {
    table.textures[i] = make_texture_slot(slot);
    if (slot.present()) table.present |= 1u << i;
  };
  set(kTextureBaseColor, m.base_color_texture);
  set(kTextureMetallicRoughness, m.metallic_roughness_texture);
  set(kTextureSpecular, m.specular_texture);
  set(kTextureSpecularColor, m.specular_color_texture);
  set(kTextureTransmission, m.transmission_texture);
  set(kTextureSpecularGlossiness, m.specular_glossiness_texture);
  set(kNumberRoughness, numbers.roughness);
  set(kNumberRoughnessAcross, numbers.roughness_across);
  set(kNumberMetallic, numbers.metallic);
  set(kNumberTransmission, numbers.transmission);
  set(kNumberAnisotropic, numbers.anisotropic);
  set(kNumberSpecTint, numbers.spec_tint);
  set(kNumberSheen, numbers.sheen);
  set(kNumberSheenTint, numbers.sheen_tint);
  set(kNumberFlatness, numbers.flatness);
  set(kNumberClearcoat, numbers.clearcoat);
  set(kNumberClearcoatGloss, numbers.clearcoat_gloss);
  table.emission_texture =
      make_texture_slot(m.model == MaterialModel::unlit ? m.base_color_texture : m.emission_texture);
  table.normal_texture = make_texture_slot(m.normal_texture);
  table.bump_texture = make_texture_slot(m.bump_texture);
  table.alpha_texture = make_texture_slot(alpha_slot(m));
  table.blend_weight_texture = make_texture_slot(m.blend.weight_texture);
}

MaterialTable make_material_table(const Material& m, const MaterialRecord& r) {
  MaterialTable table{};
  table.flags = flags_of(m, r);
  table.emission = r.emission;
  table.absorption = r.absorption;
  table.roughness = m.roughness;
  table.roughness_across = m.roughness_across;
  table.glossiness = m.glossiness;
  table.distribution = std::uint32_t(m.distribution);
  table.map_rule = std::uint32_t(m.map_rule);
  table.normal_scale = m.normal_scale;
  table.bump_scale = m.bump_scale;
  table.alpha_mode = std::uint32_t(m.alpha_mode);
  table.alpha_cutoff = m.alpha_cutoff;
  table.base_alpha = m.base_alpha;
  const bool blend = r.params.model == LobeModel::blend;
  table.blend_first = blend ? std::uint32_t(m.blend.first) : kNone;
  table.blend_second = blend ? std::uint32_t(m.blend.second) : kNone;
  table.blend_weight = m.blend.weight;
  set_textures(m, table);
  return table;
}

bool has_vertex_colors(const SceneData& data) {
  const auto colored = [](const PartRecord& part) { return part.mesh && !part.mesh->colors.empty(); };
  return std::any_of(data.flat.begin(), data.flat.end(), colored) ||
         std::any_of(data.object_parts.begin(), data.object_parts.end(), colored);
}

std::uint32_t features_of(const Material& m, const MaterialRecord& r) {
  const auto bit = [](bool set, std::uint32_t feature) { return set ? feature : 0u; };
  const SurfaceParams& p = r.params;
  const bool anisotropic = is_anisotropic(p.distribution) || r.numbers_textured;
  const TextureSlot& emission = r.unlit ? m.base_color_texture : m.emission_texture;
  return 1u << std::uint32_t(p.model) | bit(r.textured, kFeatureTextures) | bit(r.normal_mapped, kFeatureNormalMaps) |
         bit(r.scatters_mapped, kFeatureScatterMaps) | bit(r.emissive && emission.present(), kFeatureEmissionMaps) |
         bit(anisotropic, kFeatureAnisotropy) | bit(is_beckmann(p.distribution), kFeatureBeckmann) |
         bit(p.transmission > 0, kFeatureTransmission);
}

}  // namespace

Result<BsdfTables> BsdfTables::place(Arena& arena) {
  BsdfTables tables;
  const Result<std::uint64_t> ggx =
      arena.upload_value(*make_albedo_table(MicrofacetDistribution::ggx), "albedo tables");
  if (!ggx) return ggx.error();
  const Result<std::uint64_t> beckmann =
      arena.upload_value(*make_albedo_table(MicrofacetDistribution::beckmann), "albedo tables");
  if (!beckmann) return beckmann.error();
  tables.albedo_ggx = *ggx;
  tables.albedo_beckmann = *beckmann;
  return tables;
}

PlasticTable make_plastic_table(const PlasticInterface& interface) {
  PlasticTable table{};
  table.eta = interface.eta;
  table.internal_reflectance = interface.internal_reflectance;
  table.nonlinear = interface.nonlinear;
  table.smooth_interface = interface.smooth;
  std::copy(interface.transmittance.begin(), interface.transmittance.end(), table.transmittance);
  return table;
}

LobeParams make_lobe_params(const SurfaceParams& p, const BsdfTables& tables, std::uint64_t plastic) {
  LobeParams lobes{};
  lobes.albedo = is_beckmann(p.distribution) ? tables.albedo_beckmann : tables.albedo_ggx;
  lobes.plastic = plastic;
  lobes.model = std::uint32_t(p.model);
  lobes.distribution = std::uint32_t(p.distribution);
  lobes.thin = p.thin;
  lobes.tinted_reflection = p.tinted_reflection;
  lobes.mapped = p.mapped;
  lobes.alpha = p.alpha;
  lobes.base_color = p.base_color;
  lobes.metallic = p.metallic;
  lobes.transmission = p.transmission;
  lobes.ior = p.ior;
  lobes.specular = p.specular;
  lobes.specular_color = p.specular_color;
  lobes.f0 = p.f0;
  lobes.eta = p.eta;
  lobes.k = p.k;
  lobes.alpha_along = p.alpha_along;
  lobes.alpha_across = p.alpha_across;
  lobes.along = p.along;
  lobes.map_normal = p.map_normal;
  lobes.map_alpha2 = p.map_alpha2;
  const PrincipledMaterial& own = p.principled;
  lobes.principled = {own.anisotropic, own.spec_tint, own.sheen,          own.sheen_tint,
                      own.flatness,    own.clearcoat, own.clearcoat_gloss};
  return lobes;
}

std::uint64_t HostMaterials::bytes() const {
  const auto plastics = std::uint64_t(
      std::count_if(entries.begin(), entries.end(), [](const Entry& entry) { return entry.plastic != nullptr; }));
  return kBsdfTableBytes + plastics * (sizeof(PlasticTable) + kAlignment) + entries.size() * sizeof(MaterialTable) +
         kAlignment;
}

Result<std::uint64_t> HostMaterials::place(Arena& arena) const {
  const Result<BsdfTables> tables = BsdfTables::place(arena);
  if (!tables) return tables.error();
  std::vector<MaterialTable> materials;
  for (const Entry& entry : entries) {
    std::uint64_t plastic = 0;
    if (entry.plastic) {
      const Result<std::uint64_t> placed = arena.upload_value(make_plastic_table(*entry.plastic), "plastic tables");
      if (!placed) return placed.error();
      plastic = *placed;
    }
    materials.push_back(entry.table);
    materials.back().params = make_lobe_params(entry.params, *tables, plastic);
  }
  return arena.upload_vector(materials, "materials");
}

HostMaterials make_host_materials(const std::vector<Material>& materials, const std::vector<MaterialRecord>& records) {
  HELIO_CHECK(materials.size() == records.size());
  HostMaterials host;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const MaterialRecord& record = records[i];
    host.entries.push_back({make_material_table(materials[i], record), record.params, record.plastic});
  }
  return host;
}

std::vector<bool> used_materials(const SceneData& data) {
  const std::vector<Material>& materials = data.description.materials;
  std::vector<bool> used(materials.size());
  std::vector<std::size_t> found;
  const auto use = [&](std::size_t i) {
    if (!used[i]) found.push_back(i);
    used[i] = true;
  };
  for (const PartRecord& part : data.flat) use(part.material);
  for (const PartRecord& part : data.object_parts) use(part.material);
  while (!found.empty()) {
    const Material& material = materials[found.back()];
    found.pop_back();
    if (material.model != MaterialModel::blend) continue;
    use(std::size_t(material.blend.first));
    use(std::size_t(material.blend.second));
  }
  return used;
}

std::uint32_t material_features(const SceneData& data) {
  const std::vector<bool> used = used_materials(data);
  std::uint32_t features = has_vertex_colors(data) ? kFeatureTextures | kFeatureEmissionMaps : 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) features |= features_of(data.description.materials[i], data.materials[i]);
  }
  return features;
}

}  // namespace helio::vulkan
