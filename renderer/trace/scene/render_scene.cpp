#include "renderer/trace/scene/render_scene.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <limits>

#include "renderer/base/clock.h"
#include "renderer/scene/description/material_slots.h"
#include "renderer/scene/images/environment.h"
#include "renderer/trace/accel/edge_dilation.h"
#include "renderer/trace/bsdf/bsdf_sheen.h"
#include "renderer/trace/bsdf/microfacet_albedo.h"
#include "renderer/trace/sampling/sampler.h"
#include "renderer/trace/scene/build_memory.h"
#include "renderer/trace/scene/float_resolution.h"
#include "renderer/trace/scene/light_gathering.h"
#include "renderer/trace/scene/placement.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/trace/scene/surface.h"
#include "renderer/trace/scene/watertightness.h"

namespace helio {
namespace {

V3f unit_or_zero(const V3d& v) {
  const double l = length(v);
  return l > 0 && std::isfinite(l) ? V3f(v / l) : V3f(0, 0, 0);
}

// World space, rebased. The identity with a zero origin leaves every bit as it was.
void bake(TriangleMesh& mesh, const M44d& to_world, const V3d& origin) {
  for (V3f& p : mesh.positions) p = V3f(transform_point(to_world, V3d(p)) - origin);
  const Linear linear(to_world);
  const Linear normals = linear.normal_transform();
  if (to_world != M44d()) {
    for (V3f& n : mesh.normals) n = unit_or_zero(normals.apply(n));
    for (V4f& t : mesh.tangents) {
      const V3f d = unit_or_zero(linear.apply(V3f(t.x, t.y, t.z)));
      t = V4f(d.x, d.y, d.z, linear.determinant() < 0 ? -t.w : t.w);
    }
  }
  if (linear.determinant() < 0) {
    // A mirrored object keeps its front: the winding turns round.
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  }
}

// Numbers of materials are kept in 16 bits along a path (MediumStack).
constexpr std::size_t kMaxMaterials = 65535;

class Builder {
 public:
  explicit Builder(SceneData& data) : data_(data), scene_(data.description), assets_(std::make_shared<SceneAssets>()) {
    data.assets = assets_;
  }

  Status run(const RenderSceneOptions& options) {
    const auto cancelled = [&] { return options.cancel && options.cancel->cancelled(); };
    data_.features = find_scene_features(scene_);
    drop_unusable_instances();
    place();
    if (drop_untraceable_instances()) place();
    TextureOptions texture_options;
    if (options.texture_filter == TextureFilter::mip) texture_options.mip_mapped = reflection_textures();
    if (Status fits = check_size(texture_options, options); !fits) return fits;
    if (cancelled()) return cancelled_error();
    data_.mip_mapped = !texture_options.mip_mapped.empty();
    assets_->material_uses = find_material_uses(scene_);
    assets_->images = std::move(scene_.images);
    assets_->objects = std::move(scene_.objects);
    assets_->textures.emplace(std::span<const Image>(assets_->images), texture_options);
    data_.textures = &*assets_->textures;
    for (const Material& m : scene_.materials) {
      data_.materials.push_back(make_material_record(m));
      prepare_material_tables(m, data_.features);
    }
    split_objects();
    // Worth an attempt; make_flat_parts() gives it up for meshes that are too fine.
    widen_ = options.rays == RayMode::measured && data_.radius > 0 && all_baked();
    make_flat_parts();
    make_instances();
    if (cancelled()) return cancelled_error();
    gather_lights(data_, memory_.emitter_count);
    if (cancelled()) return cancelled_error();

    if (Status traced = make_accel(options); !traced) return traced;
    count();
    for (std::string& notice : find_unresolved_views(data_)) scene_.report.notices.push_back(std::move(notice));
    return ok_status();
  }

 private:
  std::vector<TextureSlot> reflection_textures() const {
    std::vector<TextureSlot> slots;
    for (const Material& m : scene_.materials) {
      for_each_texture_slot(m, [&](const TextureSlot& slot) {
        const bool reflects = &slot != &m.emission_texture && &slot != &m.thickness_texture;
        if (reflects && slot.present() && slot.filter != FilterMode::nearest) slots.push_back(slot);
      });
    }
    return slots;
  }

  static Error cancelled_error() { return {ErrorCode::cancelled, "the build was cancelled", {}}; }

  // What can be counted is held to its limits before any of it is made.
  Status check_size(const TextureOptions& texture_options, const RenderSceneOptions& options) {
    if (scene_.materials.size() > kMaxMaterials) {
      return Error{ErrorCode::resource_exhausted,
                   fmt::format("{} materials; allowed: at most {}", scene_.materials.size(), kMaxMaterials),
                   "materials"};
    }
    memory_ = estimate_build_memory(scene_, texture_options.mip_mapped);
    if (memory_.emitter_count >= kMaxEmitters) {
      return Error{ErrorCode::resource_exhausted,
                   fmt::format("{} emissive triangles, instances counted; allowed: fewer than {}",
                               memory_.emitter_count, kMaxEmitters),
                   "lights"};
    }
    if (memory_.total() > scene_.memory_limit) {
      return Error{
          ErrorCode::resource_exhausted,
          fmt::format("the scene needs {} bytes where its load may take {}: {} for meshes, images and nodes, "
                      "{} for {} instances, {} for mip-mapped textures, {} for {} emissive triangles as lights",
                      memory_.total(), scene_.memory_limit, memory_.description, memory_.instances,
                      scene_.instances.size(), memory_.pyramids, memory_.emitters, memory_.emitter_count),
          "memory"};
    }
    return hold(options, memory_.total() + map_bytes());
  }

  Status hold(const RenderSceneOptions& options, std::uint64_t bytes) const {
    if (!options.ledger || options.ledger->raise_to(bytes)) return ok_status();
    return options.ledger->refusal(bytes - std::min(bytes, options.ledger->held()), "the scene");
  }

  // Read while the images are still the description's.
  std::uint64_t map_bytes() const {
    const int map = scene_.environment ? scene_.environment->image : -1;
    return map >= 0 ? scene_.images[std::size_t(map)].bytes() : 0;
  }

  Status make_accel(const RenderSceneOptions& options) {
    accel_input_.alpha_test = &data_;
    accel_input_.threads = options.threads;
    accel_input_.cancel = options.cancel;
    accel_input_.ledger = options.ledger;
    accel_input_.max_bytes = std::size_t(scene_.memory_limit - std::min(scene_.memory_limit, resident_bytes()));
    if (widen_) {
      accel_input_.edge_dilation_radius = data_.radius;
      auto accel = Accel::build(accel_input_);
      // Without the memory for it the robust one, which takes less, may still fit.
      if (!accel && accel.error().code != ErrorCode::resource_exhausted) return std::move(accel).error();
      if (accel) {
        data_.accel = std::move(*accel);
        data_.features.fast_rays = estimate_leaks(data_, options.threads).rate_limit <= kMaxLeakRate;
      }
      if (data_.features.fast_rays) {
        set_flat_offsets(data_, data_.radius);
        return ok_status();
      }
      const std::size_t given_up = data_.accel ? data_.accel->memory_bytes() : 0;
      data_.accel.reset();
      if (options.ledger) options.ledger->shrink(given_up);
      if (options.cancel && options.cancel->cancelled()) return cancelled_error();
    }
    accel_input_.edge_dilation_radius = 0;
    auto accel = Accel::build(accel_input_);
    if (!accel) return std::move(accel).error();
    data_.accel = std::move(*accel);
    return ok_status();
  }

  void drop_unusable_instances() {
    std::vector<Instance> kept;
    kept.reserve(scene_.instances.size());
    for (const Object& object : scene_.objects) assets_->boxes.push_back(object_box(object));
    for (Instance& instance : scene_.instances) {
      if (!is_usable_transform(instance.to_world)) {
        const Box3d& box = assets_->boxes[std::size_t(instance.object)];
        const auto flat = with_thickness(instance.to_world, scene_.objects[std::size_t(instance.object)],
                                         box.isEmpty() ? V3d(0) : box.center(), instance.flat_mirrored);
        if (flat) instance.to_world = *flat;
      }
      if (!is_usable_transform(instance.to_world)) {
        scene_.report.notices.push_back(instance.name + ": its transform leaves it no area; not rendered");
      } else if (!is_in_range(assets_->boxes[std::size_t(instance.object)], instance.to_world)) {
        scene_.report.notices.push_back(instance.name + ": it reaches beyond 1e12 units; not rendered");
      } else {
        kept.push_back(std::move(instance));
      }
    }
    scene_.instances = std::move(kept);
  }

  // True when there were any.
  bool drop_untraceable_instances() {
    return std::erase_if(scene_.instances, [&](const Instance& instance) {
             if (is_traceable(instance.to_world, double(data_.radius))) return false;
             scene_.report.notices.push_back(instance.name +
                                             ": it is too small for a scene of this extent; not rendered");
             return true;
           }) > 0;
  }

  void place() {
    Box3d world;
    for (const Instance& instance : scene_.instances) {
      const Box3d box = transform_box(assets_->boxes[std::size_t(instance.object)], instance.to_world);
      if (!box.isEmpty()) world.extendBy(box);
    }
    data_.world_bounds = world;
    data_.origin = world.isEmpty() ? V3d(0, 0, 0) : world.center();
    data_.radius = world.isEmpty() ? 0.0f : float(0.5 * length(world.size()));
  }

  // Objects that are placed once are baked into the top level; the others stay instances.
  void split_objects() {
    uses_.assign(assets_->objects.size(), 0);
    for (const Instance& instance : scene_.instances) ++uses_[std::size_t(instance.object)];
    assets_->baked.assign(assets_->objects.size(), false);
    for (const Instance& instance : scene_.instances) {
      const Object& object = assets_->objects[std::size_t(instance.object)];
      const Linear linear(instance.to_world);
      assets_->baked[std::size_t(instance.object)] =
          uses_[std::size_t(instance.object)] == 1 &&
          (object.spheres.empty() || (linear.uniform_scale() > 0 && !turns_texture(object, linear)));
    }
  }

  bool all_baked() const {
    return std::all_of(scene_.instances.begin(), scene_.instances.end(),
                       [&](const Instance& instance) { return assets_->baked[std::size_t(instance.object)]; });
  }

  // A baked sphere is a centre and a radius: its texture coordinates are those of its own space only if that is not
  // turned.
  bool turns_texture(const Object& object, const Linear& linear) const {
    return turns(linear) && std::any_of(object.spheres.begin(), object.spheres.end(), [&](const Sphere& sphere) {
             return has_orientation(scene_.materials[std::size_t(sphere.material)]);
           });
  }

  // Embree reads 16 bytes at the last 12-byte position.
  static void pad(TriangleMesh& mesh) { mesh.positions.reserve(mesh.positions.size() + 2); }

  AccelPart make_accel_part(const TriangleMesh& mesh) const {
    return accel_part(mesh, scene_.materials[std::size_t(mesh.material)], *data_.textures);
  }
  AccelPart make_accel_part(const V3f& center, float radius, int material) const {
    return accel_part(center, radius, scene_.materials[std::size_t(material)], *data_.textures);
  }

  void make_flat_parts() {
    for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
      const Instance& instance = scene_.instances[i];
      if (!assets_->baked[std::size_t(instance.object)]) continue;
      Object& object = assets_->objects[std::size_t(instance.object)];
      for (TriangleMesh& mesh : object.meshes) {
        bake(mesh, instance.to_world, data_.origin);
        if (mesh.indices.empty()) continue;
        pad(mesh);
        if (widen_) {
          put_longest_side_last(mesh);
          widen_ = edge_dilation_share(mesh, kEdgeDilation * double(data_.radius)) <= kMaxEdgeDilationShare;
        }
        add_flat(part_record(mesh), make_accel_part(mesh), i);
      }
      const double scale = Linear(instance.to_world).uniform_scale();
      for (const Sphere& sphere : object.spheres) {
        const V3f center(transform_point(instance.to_world, V3d(sphere.center)) - data_.origin);
        const float radius = float(sphere.radius * scale);
        add_flat(part_record(center, radius, std::uint32_t(sphere.material)),
                 make_accel_part(center, radius, sphere.material), i);
      }
    }
  }

  void add_flat(const PartRecord& record, const AccelPart& part, std::size_t instance) {
    data_.flat.push_back(record);
    data_.flat.back().through = record.offset;
    data_.flat_names.push_back(std::uint32_t(instance));
    accel_input_.flat.push_back(part);
  }

  void make_instances() {
    const std::size_t count = assets_->objects.size();
    std::vector<std::uint32_t> accel_object(count, kNoHit), first_part(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
      if (assets_->baked[i] || uses_[i] == 0) continue;
      Object& object = assets_->objects[i];
      AccelObject accel;
      first_part[i] = std::uint32_t(data_.object_parts.size());
      for (TriangleMesh& mesh : object.meshes) {
        if (mesh.indices.empty()) continue;
        pad(mesh);
        data_.object_parts.push_back(part_record(mesh));
        accel.parts.push_back(make_accel_part(mesh));
      }
      for (const Sphere& sphere : object.spheres) {
        data_.object_parts.push_back(part_record(sphere.center, sphere.radius, std::uint32_t(sphere.material)));
        accel.parts.push_back(make_accel_part(sphere.center, sphere.radius, sphere.material));
      }
      if (accel.parts.empty()) continue;
      accel_object[i] = std::uint32_t(accel_input_.objects.size());
      accel_input_.objects.push_back(std::move(accel));
    }
    for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
      const std::size_t object = std::size_t(scene_.instances[i].object);
      if (accel_object[object] == kNoHit) continue;
      InstanceRecord record;
      record.first_part = first_part[object];
      record.part_count = std::uint32_t(accel_input_.objects[accel_object[object]].parts.size());
      record.accel_object = accel_object[object];
      set_placement(record, rebased(scene_.instances[i].to_world, data_.origin));
      accel_input_.instances.push_back(accel_instance(record));
      data_.instances.push_back(record);
      data_.instance_names.push_back(std::uint32_t(i));
    }
  }

  // All but the BVH of the meshes and the environment's map.
  std::uint64_t resident_bytes() const {
    return memory_.description + memory_.instances + data_.textures->memory_bytes() + data_.lights->memory_bytes();
  }

  void count() {
    RenderSceneStats& stats = data_.stats;
    std::vector<std::uint64_t> triangles;
    for (const Object& object : assets_->objects) {
      std::uint64_t n = 0;
      for (const TriangleMesh& mesh : object.meshes) n += mesh.triangle_count();
      stats.triangles += n;
      stats.meshes += object.meshes.size();
      triangles.push_back(n);
    }
    stats.images = assets_->images.size();
    for (const Instance& instance : scene_.instances)
      stats.instanced_triangles += triangles[std::size_t(instance.object)];
    const int map = scene_.environment ? scene_.environment->image : -1;
    const std::uint64_t map_bytes = map >= 0 ? assets_->images[std::size_t(map)].bytes() : 0;
    assets_->bytes = memory_.description - instance_bytes(scene_) + map_bytes + data_.textures->memory_bytes();
    count_memory(data_);
    stats.own_bytes = stats.memory_bytes;
  }

  SceneData& data_;
  SceneDescription& scene_;
  const std::shared_ptr<SceneAssets> assets_;
  BuildMemory memory_;
  std::vector<std::uint32_t> uses_;  // by object
  bool widen_ = false;
  AccelInput accel_input_;
};

}  // namespace

AccelPart accel_part(const TriangleMesh& mesh, const Material& material, const TextureTable& textures) {
  AccelPart part;
  part.positions = mesh.positions.data();
  part.vertex_count = mesh.positions.size();
  part.indices = mesh.indices.data();
  part.triangle_count = mesh.triangle_count();
  part.alpha = has_alpha(material, &mesh, textures);
  return part;
}

AccelPart accel_part(const V3f& center, float radius, const Material& material, const TextureTable& textures) {
  AccelPart part;
  part.kind = AccelPart::Kind::sphere;
  part.alpha = has_alpha(material, nullptr, textures);
  part.sphere = V4f(center.x, center.y, center.z, radius);
  return part;
}

AccelInstance accel_instance(const InstanceRecord& record) {
  AccelInstance instance;
  instance.object = record.accel_object;
  std::copy_n(record.to_world, 12, instance.to_world);
  return instance;
}

PartRecord part_record(const TriangleMesh& mesh) {
  PartRecord record;
  record.mesh = &mesh;
  record.material = std::uint32_t(mesh.material);
  record.smooth = !mesh.normals.empty();
  float extent = 0;
  for (const V3f& p : mesh.positions) extent = std::max({extent, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
  record.offset = extent * kOffsetFactor;
  return record;
}

PartRecord part_record(const V3f& center, float radius, std::uint32_t material) {
  PartRecord record;
  record.center = center;
  record.radius = radius;
  record.material = material;
  record.offset = (std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)}) + radius) * kOffsetFactor;
  return record;
}

void prepare_material_tables(const Material& material, const SceneFeatures& features) {
  if (!features.only_lambert) prepare_albedo_tables(material.distribution);
  if (!features.layers) return;
  prepare_albedo_tables(MicrofacetDistribution::ggx);
  prepare_sheen_table();
}

float edge_dilation_offset(float edge_dilation_radius) {
  return float(1.0625 * kEdgeDilation * double(edge_dilation_radius));
}

void set_flat_offsets(SceneData& data, float edge_dilation_radius) {
  // On the other side, where two sides meet at 30 degrees.
  const float through = float(0.5 * kEdgeDilation * double(edge_dilation_radius));
  for (PartRecord& part : data.flat) {
    const float offset = (part.mesh ? part_record(*part.mesh) : part_record(part.center, part.radius, 0)).offset;
    part.through = std::max(offset, through);
    part.offset = std::max(offset, edge_dilation_offset(edge_dilation_radius));
  }
}

void count_memory(SceneData& data) {
  const EnvironmentDistribution* map = data.environment_table.distribution.get();
  const std::uint64_t map_table = map ? map->memory_bytes() : 0;
  const std::uint64_t lights = data.lights->memory_bytes();  // the map's table included
  data.table_bytes = lights - std::min(lights, map_table) + instance_bytes(data.description) +
                     data.instances.capacity() * sizeof(InstanceRecord) +
                     (data.flat.capacity() + data.object_parts.capacity()) * sizeof(PartRecord) +
                     data.materials.size() * (sizeof(Material) + sizeof(MaterialRecord));
  data.stats.memory_bytes = data.table_bytes + map_table + data.assets->bytes + data.accel->memory_bytes();
}

bool SceneData::opaque_at(const AlphaHit& hit) const {
  const PartRecord& record =
      hit.instance == kNoHit ? flat[hit.part] : object_parts[instances[hit.instance].first_part + hit.part];
  const Material& material = description.materials[record.material];
  const float alpha = surface_alpha(*this, record, hit.primitive, V2f(hit.u, hit.v), hit.normal);
  if (material.alpha_mode == AlphaMode::mask) return alpha >= material.alpha_cutoff;
  // Every surface on the way decides by its own random number, the same whenever the same ray meets it. A sphere is met
  // twice: its near and its far side are two surfaces.
  const std::uint32_t surface = record.mesh ? hit.primitive : std::uint32_t(!hit.front);
  const std::uint32_t bits = combine_hash(combine_hash(hit.alpha_key, surface), combine_hash(hit.part, hit.instance));
  return unit_float(bits) < alpha;
}

RenderScene::RenderScene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RenderScene::~RenderScene() = default;

Result<std::shared_ptr<const RenderScene>> RenderScene::build(SceneDescription description,
                                                              const RenderSceneOptions& options) {
  const double begin = now_s();
  auto impl = std::make_unique<Impl>();
  impl->description = std::move(description);
  if (impl->description.materials.empty()) impl->description.materials.emplace_back();
  Status built = Builder(*impl).run(options);
  if (!built) return std::move(built).error();
  impl->stats.build_seconds = now_s() - begin;
  return std::shared_ptr<const RenderScene>(new RenderScene(std::move(impl)));
}

const SceneDescription& RenderScene::description() const {
  return impl_->description;
}
const SceneFeatures& RenderScene::features() const {
  return impl_->features;
}
const RenderSceneStats& RenderScene::stats() const {
  return impl_->stats;
}
const V3d& RenderScene::origin() const {
  return impl_->origin;
}
const EditSummary* RenderScene::edit() const {
  return impl_->edit ? &*impl_->edit : nullptr;
}
std::vector<MemoryShare> RenderScene::memory() const {
  std::vector<MemoryShare> shares;
  shares.push_back({impl_->lights, impl_->table_bytes});
  shares.push_back({impl_->assets, impl_->assets->bytes});
  if (const auto& table = impl_->environment_table.distribution) shares.push_back({table, table->memory_bytes()});
  for (AccelShare& share : impl_->accel->shares()) shares.push_back({std::move(share.what), share.bytes});
  return shares;
}
Box3d RenderScene::world_bounds() const {
  return impl_->world_bounds;
}

}  // namespace helio
