#include "renderer/vulkan/scene/light_tables.h"

#include <algorithm>
#include <cstddef>
#include <initializer_list>

#include "renderer/vulkan/scene/texture_tables.h"

namespace helio::vulkan {
namespace {

static_assert(std::uint32_t(ShapeKind::triangle) == kShapeTriangle &&
              std::uint32_t(ShapeKind::parallelogram) == kShapeParallelogram &&
              std::uint32_t(ShapeKind::sphere) == kShapeSphere &&
              std::uint32_t(ShapeKind::ellipsoid) == kShapeEllipsoid);
static_assert(std::uint32_t(PunctualKind::point) == kPunctualPoint &&
              std::uint32_t(PunctualKind::spot) == kPunctualSpot &&
              std::uint32_t(PunctualKind::directional) == kPunctualDirectional &&
              std::uint32_t(PunctualKind::projector) == kPunctualProjector);
using Selection = LightSampler::Selection;
static_assert(std::uint32_t(Selection::none) == kSelectionNone && std::uint32_t(Selection::one) == kSelectionOne &&
              std::uint32_t(Selection::power) == kSelectionPower && std::uint32_t(Selection::tree) == kSelectionTree);

static_assert(LightTree::kWidth == kLightTreeWidth && LightTree::kLeaf == kLightTreeLeaf);
// The bit of a shape is kHasTriangles shifted by its kind.
static_assert(kHasTriangles << kShapeParallelogram == kHasParallelograms &&
              kHasTriangles << kShapeSphere == kHasSpheres && kHasTriangles << kShapeEllipsoid == kHasEllipsoids);
// Alias tables are uploaded as the CPU has them.
using Bin = AliasTable::Bin;
static_assert(sizeof(Bin) == sizeof(AliasBinTable) && offsetof(Bin, alias) == offsetof(AliasBinTable, alias) &&
              offsetof(Bin, probability) == offsetof(AliasBinTable, probability));

// Numbers texture slots in the order in which they first appear. Emitters of a mesh share theirs, so the newest is
// looked at first.
class SlotNumbers {
 public:
  explicit SlotNumbers(std::vector<TextureSlotTable>& tables) : tables_(tables) {}

  std::uint32_t number(const TextureSlot& slot) {
    if (!slot.present()) return kNone;
    if (newest_ < slots_.size() && slots_[newest_] == slot) return newest_;
    const auto known = std::find(slots_.begin(), slots_.end(), slot);
    newest_ = std::uint32_t(known - slots_.begin());
    if (known == slots_.end()) {
      slots_.push_back(slot);
      tables_.push_back(make_texture_slot(slot));
    }
    return newest_;
  }

 private:
  std::vector<TextureSlotTable>& tables_;
  std::vector<TextureSlot> slots_;
  std::uint32_t newest_ = 0;
};

AreaLightTable area_table(const AreaLight& light, const TextureSlot& texture, SlotNumbers& slots) {
  const AreaShape& shape = light.shape;
  return {.p0 = shape.p0,
          .e1 = shape.e1,
          .e2 = shape.e2,
          .e3 = shape.e3,
          .normal = shape.normal,
          .center = shape.center,
          .area = shape.area,
          .near_squared = shape.near_squared,
          .radius = shape.radius,
          .radiance = light.radiance,
          .uv = light.uv,
          .uv_s = light.uv_s,
          .uv_t = light.uv_t,
          .flags = std::uint32_t(shape.kind) | (shape.two_sided ? kShapeTwoSided : 0),
          .slot = light.textured ? slots.number(texture) : kNone,
          .alpha = light.alpha};
}

LightAlphaTable alpha_table(const LightAlpha& alpha, SlotNumbers& slots) {
  return {.uv = alpha.uv,
          .uv_s = alpha.uv_s,
          .uv_t = alpha.uv_t,
          .factor = alpha.factor,
          .factor_s = alpha.factor_s,
          .factor_t = alpha.factor_t,
          .cutoff = alpha.cutoff,
          .mask = alpha.mask,
          .slot = slots.number(alpha.texture)};
}

PunctualLightTable punctual_table(const PunctualSource& source) {
  return {.position = source.position,
          .direction = source.direction,
          .intensity = source.intensity,
          .inverse_range = source.inverse_range,
          .cone_scale = source.cone_scale,
          .cone_offset = source.cone_offset,
          .kind = std::uint32_t(source.kind),
          .linear_cone = source.linear_cone,
          .projector = source.projector};
}

LightTreeChildTable child_table(const LightTree::Node& node, int slot) {
  return {.ball = V4f(node.center_x[slot], node.center_y[slot], node.center_z[slot], node.radius[slot]),
          .cone = V4f(node.axis_x[slot], node.axis_y[slot], node.axis_z[slot], node.cos_theta_o[slot]),
          .emission = V4f(node.cos_theta_e[slot], node.one_sided[slot], node.intensity[slot], node.range[slot]),
          .child = node.child[slot],
          .spread = node.spread[slot],
          .padding = {}};
}

void set_environment(const LightSampler::Parts& parts, SlotNumbers& slots, HostLights& host) {
  EnvironmentLightTable& table = host.tables.environment;
  table.slot = kNone;
  table.scale = V3f(0, 0, 0);
  std::ranges::fill(table.axes, V3f(0, 0, 0));
  if (!parts.environment) return;
  table.scale = parts.environment->scale();
  std::ranges::copy(parts.environment->axes(), table.axes);
  if (parts.environment->constant()) return;
  table.slot = slots.number(parts.environment->slot());
  if (!parts.environment_distribution) return;
  const EnvironmentDistribution& distribution = *parts.environment_distribution;
  table.columns = std::uint32_t(distribution.columns());
  table.rows = std::uint32_t(distribution.rows());
  host.column_cdf = distribution.column_cdf();
  host.row_cdf = distribution.row_cdf();
  host.row_cos = distribution.row_cos();
  host.density = distribution.density();
}

}  // namespace

HostLights make_host_lights(const LightSampler& lights) {
  static_assert(kNoLight == kNone && kOpaqueEmitter == kNone);
  const LightSampler::Parts parts = lights.parts();
  HostLights host{};
  SlotNumbers slots(host.slots);
  for (const AreaLight& light : parts.areas)
    host.areas.push_back(area_table(light, lights.emitters()[light.emitter].texture, slots));
  for (const LightAlpha& alpha : parts.alphas) host.alphas.push_back(alpha_table(alpha, slots));
  for (const PunctualSource& source : parts.punctual) host.punctual.push_back(punctual_table(source));
  for (const Projector& p : parts.projectors)
    host.projectors.push_back({p.across, p.down, p.depth, p.axis, slots.number(p.picture)});
  for (std::size_t e = 0; e < lights.emitters().size(); ++e) {
    const AreaEmitter& emitter = lights.emitters()[e];
    host.emitters.push_back({.radiance = emitter.radiance,
                             .light = parts.light_of_emitter[e],
                             .slot = slots.number(emitter.texture),
                             .two_sided = emitter.two_sided});
  }
  host.power = parts.power->bins();
  host.infinite = parts.infinite->bins();
  for (const LightTree::Node& node : parts.tree->nodes()) {
    for (int slot = 0; slot < LightTree::kWidth; ++slot) host.nodes.push_back(child_table(node, slot));
  }
  host.node_places = parts.tree->node_places();
  host.places = parts.tree->places();
  set_environment(parts, slots, host);

  LightTables& tables = host.tables;
  tables.selection = std::uint32_t(parts.selection);
  tables.environment_light = parts.environment_light;
  tables.area_count = std::uint32_t(host.areas.size());
  tables.punctual_count = std::uint32_t(host.punctual.size());
  tables.finite_count = parts.finite_count;
  tables.power_count = std::uint32_t(host.power.size());
  tables.infinite_count = std::uint32_t(host.infinite.size());
  tables.infinite_probability = parts.infinite_probability;
  return host;
}

namespace {

constexpr std::uint64_t kArrayAlignment = 64;  // of a line of the cache

// Calls f(array, what it is, address in `tables`) for every array of `host`, until one fails.
template <class F>
Status for_each_array(const HostLights& host, LightTables& tables, F&& f) {
  EnvironmentLightTable& map = tables.environment;
  Status status = ok_status();
  const auto visit = [&](auto values, const char* what, std::uint64_t& address) {
    if (status) status = f(values, what, address);
  };
  visit(std::span(host.areas), "the area lights", tables.areas);
  visit(std::span(host.punctual), "the punctual lights", tables.punctual);
  visit(std::span(host.projectors), "the projectors", tables.projectors);
  visit(std::span(host.emitters), "the emitters", tables.emitters);
  visit(std::span(host.alphas), "the alphas of the area lights", tables.alphas);
  visit(std::span(host.slots), "the texture slots of the lights", tables.slots);
  visit(host.power, "the selection of lights by power", tables.power);
  visit(host.infinite, "the selection of infinite lights", tables.infinite);
  visit(std::span(host.nodes), "the light tree", tables.nodes);
  visit(host.node_places, "the light tree", tables.node_places);
  visit(host.places, "the light tree", tables.places);
  visit(host.column_cdf, "the distribution of the environment", map.column_cdf);
  visit(host.row_cdf, "the distribution of the environment", map.row_cdf);
  visit(host.row_cos, "the distribution of the environment", map.row_cos);
  visit(host.density, "the distribution of the environment", map.density);
  return status;
}

}  // namespace

std::uint32_t HostLights::features() const {
  std::uint32_t features = 0;
  for (const AreaLightTable& light : areas) {
    features |= kHasTriangles << (light.flags & kShapeKindMask);
    if (light.slot != kNone) features |= kHasLightTextures;
    if (light.alpha != kNone) features |= kHasLightAlphas;
  }
  if (!punctual.empty()) features |= kHasPunctual;
  if (!projectors.empty()) features |= kHasProjectors;
  // Rays look the map up even where the environment is not one of the lights.
  const EnvironmentLightTable& map = tables.environment;
  if (map.slot != kNone) features |= kHasEnvironmentMap;
  if (map.slot == kNone && tables.environment_light != 0) features |= kHasConstantEnvironment;
  if (tables.selection == kSelectionPower) features |= kHasPowerSelection;
  if (tables.selection == kSelectionTree) features |= kHasLightTree;
  if (tables.selection == kSelectionTree && !infinite.empty()) features |= kHasInfiniteSelection;
  return features;
}

std::uint64_t HostLights::bytes() const {
  std::uint64_t bytes = 0;
  LightTables unused = tables;
  const Status counted = for_each_array(*this, unused, [&](const auto& values, const char*, std::uint64_t&) {
    bytes += values.size_bytes() + kArrayAlignment;
    return ok_status();
  });
  HELIO_CHECK(counted.ok());
  return bytes;
}

Result<LightTables> HostLights::place(Arena& arena) const {
  LightTables placed = tables;
  Status status =
      for_each_array(*this, placed, [&](const auto& values, const char* what, std::uint64_t& address) -> Status {
        Result<std::uint64_t> uploaded = arena.upload(std::as_bytes(values), kArrayAlignment, what);
        if (!uploaded) return std::move(uploaded).error();
        address = *uploaded;
        return ok_status();
      });
  if (!status) return std::move(status).error();
  return placed;
}

}  // namespace helio::vulkan
