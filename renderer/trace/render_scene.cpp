#include "renderer/trace/render_scene.h"

#include <spdlog/fmt/fmt.h>

#include <cstring>
#include <limits>

#include "renderer/base/camera_limits.h"
#include "renderer/base/clock.h"
#include "renderer/scene/material_slots.h"
#include "renderer/trace/bsdf_sheen.h"
#include "renderer/trace/build_memory.h"
#include "renderer/trace/float_resolution.h"
#include "renderer/trace/leak_probe.h"
#include "renderer/trace/microfacet_albedo.h"
#include "renderer/trace/sampler.h"
#include "renderer/trace/scene_data.h"
#include "renderer/trace/surface.h"
#include "renderer/trace/widening.h"

namespace helio {
namespace {

V3d transform_point(const M44d& m, const V3d& p) {
  return {p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0],
          p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
          p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]};
}

// Rows are the images of the axes.
struct Linear {
  V3d x, y, z;
  explicit Linear(const M44d& m)
      : x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]) {}
  double determinant() const { return dot(x, cross(y, z)); }
  V3d apply(const V3f& v) const { return x * double(v.x) + y * double(v.y) + z * double(v.z); }
  // Inverse transpose up to a positive factor: cofactors, with the sign of the determinant.
  Linear normal_transform() const {
    Linear r = *this;
    const double sign = determinant() < 0 ? -1 : 1;
    r.x = cross(y, z) * sign;
    r.y = cross(z, x) * sign;
    r.z = cross(x, y) * sign;
    return r;
  }
  // The factor by which all lengths grow, or 0 when there is no single one.
  double uniform_scale() const {
    const double a = length(x), b = length(y), c = length(z), tolerance = 1e-6 * a;
    const bool equal = std::abs(a - b) <= tolerance && std::abs(a - c) <= tolerance;
    const bool orthogonal = std::abs(dot(x, y)) <= tolerance * a && std::abs(dot(x, z)) <= tolerance * a &&
                            std::abs(dot(y, z)) <= tolerance * a;
    return equal && orthogonal ? a : 0;
  }
};

// Whether the axes of what is transformed no longer point where they did.
bool turns(const Linear& l) {
  const double tolerance = 1e-9 * (length(l.x) + length(l.y) + length(l.z));
  const auto off = [&](double a, double b) { return std::abs(a) > tolerance || std::abs(b) > tolerance; };
  return off(l.x.y, l.x.z) || off(l.y.x, l.y.z) || off(l.z.x, l.z.y) || l.x.x < 0 || l.y.y < 0 || l.z.z < 0;
}

bool usable(const M44d& m) {
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (!std::isfinite(m[i][j])) return false;
    }
  }
  const Linear linear(m);
  const double volume = length(linear.x) * length(linear.y) * length(linear.z);
  return volume > 0 && std::abs(linear.determinant()) > 1e-12 * volume;
}

V3f unit_or_zero(const V3d& v) {
  const double l = length(v);
  return l > 0 && std::isfinite(l) ? V3f(v / l) : V3f(0, 0, 0);
}

Box3d object_box(const Object& object) {
  Box3d box;
  for (const TriangleMesh& mesh : object.meshes) {
    for (const V3f& p : mesh.positions) box.extendBy(V3d(p));
  }
  for (const Sphere& s : object.spheres) {
    box.extendBy(V3d(s.center) - V3d(s.radius));
    box.extendBy(V3d(s.center) + V3d(s.radius));
  }
  return box;
}

Box3d transform_box(const Box3d& box, const M44d& m) {
  Box3d out;
  if (box.isEmpty()) return out;
  for (int corner = 0; corner < 8; ++corner) {
    out.extendBy(transform_point(m, V3d(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                                        corner & 4 ? box.max.z : box.min.z)));
  }
  return out;
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

// Numbers of materials are kept in 16 bits along a path (MediumStack), those of lights in 28 (LightTree).
constexpr std::size_t kMaxMaterials = 65535;
constexpr std::uint64_t kMaxEmitters = std::uint64_t(1) << 28;
// Extent of the scene in the space of an instanced object: far enough below what can be traced to leave cameras room.
constexpr double kMaxObjectReach = 1e17;

class Builder {
 public:
  explicit Builder(SceneData& data) : data_(data), scene_(data.description) {}

  Status run(const RenderSceneOptions& options) {
    const auto cancelled = [&] { return options.cancel && options.cancel->cancelled(); };
    data_.features = find_scene_features(scene_);
    drop_unusable_instances();
    place();
    if (drop_untraceable_instances()) place();
    TextureOptions texture_options;
    if (options.texture_filter == TextureFilter::mip) texture_options.mip_mapped = reflection_textures();
    if (Status fits = check_size(texture_options); !fits) return fits;
    if (cancelled()) return cancelled_error();
    data_.mip_mapped = !texture_options.mip_mapped.empty();
    data_.textures.emplace(std::span<const Image>(scene_.images), texture_options);
    for (const Material& m : scene_.materials) {
      data_.materials.push_back(make_material_record(m));
      // Now, not on the first sample that needs them.
      if (!data_.features.only_lambert) prepare_albedo_tables(m.distribution);
      if (data_.features.layers) {
        prepare_albedo_tables(MicrofacetDistribution::ggx);
        prepare_sheen_table();
      }
    }
    split_objects();
    // Worth an attempt; make_flat_parts() gives it up for meshes that are too fine.
    widen_ = options.rays == RayMode::measured && data_.radius > 0 && all_baked();
    light_input_.areas.reserve(memory_.emitter_count);
    make_flat_parts();
    make_instances();
    if (cancelled()) return cancelled_error();
    make_lights();
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
  Status check_size(const TextureOptions& texture_options) {
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
    return ok_status();
  }

  Status make_accel(const RenderSceneOptions& options) {
    accel_input_.alpha_test = &data_;
    accel_input_.threads = options.threads;
    accel_input_.cancel = options.cancel;
    accel_input_.max_bytes = std::size_t(scene_.memory_limit - std::min(scene_.memory_limit, resident_bytes()));
    if (widen_) {
      accel_input_.widening_radius = data_.radius;
      auto accel = Accel::build(accel_input_);
      // Without the memory for it the robust one, which takes less, may still fit.
      if (!accel && accel.error().code != ErrorCode::resource_exhausted) return std::move(accel).error();
      if (accel) {
        data_.accel = std::move(*accel);
        data_.features.fast_rays = estimate_leaks(data_, options.threads).rate_limit <= kMaxLeakRate;
      }
      if (data_.features.fast_rays) {
        // Past what a widened neighbour may stand out by; on the other side, where two sides meet at 30 degrees.
        const double margin = kWidening * double(data_.radius);
        for (PartRecord& part : data_.flat) {
          part.through = std::max(part.offset, float(0.5 * margin));
          part.offset = std::max(part.offset, float(1.0625 * margin));
        }
        return ok_status();
      }
      data_.accel.reset();
      if (options.cancel && options.cancel->cancelled()) return cancelled_error();
    }
    accel_input_.widening_radius = 0;
    auto accel = Accel::build(accel_input_);
    if (!accel) return std::move(accel).error();
    data_.accel = std::move(*accel);
    return ok_status();
  }

  void drop_unusable_instances() {
    std::vector<Instance> kept;
    kept.reserve(scene_.instances.size());
    for (const Object& object : scene_.objects) boxes_.push_back(object_box(object));
    for (Instance& instance : scene_.instances) {
      const Box3d& box = boxes_[std::size_t(instance.object)];
      if (!usable(instance.to_world)) {
        scene_.report.notices.push_back(instance.name + ": its transform flattens it to nothing; not rendered");
      } else if (!in_range(box) || !in_range(transform_box(box, instance.to_world))) {
        scene_.report.notices.push_back(instance.name + ": it reaches beyond 1e12 units; not rendered");
      } else {
        kept.push_back(std::move(instance));
      }
    }
    scene_.instances = std::move(kept);
  }

  static bool in_range(const Box3d& box) {
    return box.isEmpty() || (in_coordinate_range(box.min) && in_coordinate_range(box.max));
  }

  // Inside an instance the ray is in the object's space: there, too, its numbers must be floats that can be traced.
  // True when there were any.
  bool drop_untraceable_instances() {
    const double reach = 4.0 * double(data_.radius);
    return std::erase_if(scene_.instances, [&](const Instance& instance) {
      const Linear linear(instance.to_world), cofactors = linear.normal_transform();
      const double largest = std::max({length(cofactors.x), length(cofactors.y), length(cofactors.z)});
      if (reach * largest <= kMaxObjectReach * std::abs(linear.determinant())) return false;
      scene_.report.notices.push_back(instance.name + ": it is too small for a scene of this extent; not rendered");
      return true;
    }) > 0;
  }

  void place() {
    Box3d world;
    for (const Instance& instance : scene_.instances) {
      const Box3d box = transform_box(boxes_[std::size_t(instance.object)], instance.to_world);
      if (!box.isEmpty()) world.extendBy(box);
    }
    data_.world_bounds = world;
    data_.origin = world.isEmpty() ? V3d(0, 0, 0) : world.center();
    data_.radius = world.isEmpty() ? 0.0f : float(0.5 * length(world.size()));
  }

  // Objects that are placed once are baked into the top level; the others stay instances.
  void split_objects() {
    uses_.assign(scene_.objects.size(), 0);
    for (const Instance& instance : scene_.instances) ++uses_[instance.object];
    baked_.assign(scene_.objects.size(), false);
    for (const Instance& instance : scene_.instances) {
      const Object& object = scene_.objects[instance.object];
      const Linear linear(instance.to_world);
      baked_[instance.object] =
          uses_[instance.object] == 1 &&
          (object.spheres.empty() || (linear.uniform_scale() > 0 && !turns_texture(object, linear)));
    }
  }

  bool all_baked() const {
    return std::all_of(scene_.instances.begin(), scene_.instances.end(),
                       [&](const Instance& instance) { return baked_[std::size_t(instance.object)]; });
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

  AccelPart accel_part(const TriangleMesh& mesh) const {
    AccelPart part;
    part.positions = mesh.positions.data();
    part.vertex_count = mesh.positions.size();
    part.indices = mesh.indices.data();
    part.triangle_count = mesh.triangle_count();
    part.alpha = has_alpha(scene_.materials[std::size_t(mesh.material)], &mesh, *data_.textures);
    return part;
  }

  AccelPart accel_part(const V3f& center, float radius, int material) const {
    AccelPart part;
    part.kind = AccelPart::Kind::sphere;
    part.alpha = has_alpha(scene_.materials[std::size_t(material)], nullptr, *data_.textures);
    part.sphere = V4f(center.x, center.y, center.z, radius);
    return part;
  }

  PartRecord part_record(const TriangleMesh& mesh) const {
    PartRecord record;
    record.mesh = &mesh;
    record.material = std::uint32_t(mesh.material);
    record.smooth = !mesh.normals.empty();
    float extent = 0;
    for (const V3f& p : mesh.positions) extent = std::max({extent, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
    record.offset = extent * kOffsetFactor;
    return record;
  }

  static PartRecord part_record(const V3f& center, float radius, int material) {
    PartRecord record;
    record.center = center;
    record.radius = radius;
    record.material = std::uint32_t(material);
    record.offset =
        (std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)}) + radius) * kOffsetFactor;
    return record;
  }

  void make_flat_parts() {
    for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
      const Instance& instance = scene_.instances[i];
      if (!baked_[instance.object]) continue;
      Object& object = scene_.objects[instance.object];
      for (TriangleMesh& mesh : object.meshes) {
        bake(mesh, instance.to_world, data_.origin);
        if (mesh.indices.empty()) continue;
        pad(mesh);
        if (widen_) {
          put_longest_side_last(mesh);
          widen_ = widening_share(mesh, kWidening * double(data_.radius)) <= kMaxWideningShare;
        }
        PartRecord record = part_record(mesh);
        record.first_emitter = add_emitters(mesh, [](const V3f& p) { return p; });
        add_flat(record, accel_part(mesh), i);
      }
      const double scale = Linear(instance.to_world).uniform_scale();
      for (const Sphere& sphere : object.spheres) {
        const V3f center(transform_point(instance.to_world, V3d(sphere.center)) - data_.origin);
        PartRecord record = part_record(center, float(sphere.radius * scale), sphere.material);
        AreaEmitter emitter;
        emitter.shape = AreaEmitter::Shape::sphere;
        emitter.p0 = center;
        emitter.e1 = V3f(record.radius, 0, 0);
        record.first_emitter = add_emitter(emitter, sphere.material);
        add_flat(record, accel_part(center, record.radius, sphere.material), i);
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
    std::vector<std::uint32_t> accel_object(scene_.objects.size(), kNoHit), first_part(scene_.objects.size(), 0);
    for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
      if (baked_[i] || uses_[i] == 0) continue;
      Object& object = scene_.objects[i];
      AccelObject accel;
      first_part[i] = std::uint32_t(data_.object_parts.size());
      for (TriangleMesh& mesh : object.meshes) {
        if (mesh.indices.empty()) continue;
        pad(mesh);
        data_.object_parts.push_back(part_record(mesh));
        accel.parts.push_back(accel_part(mesh));
      }
      for (const Sphere& sphere : object.spheres) {
        data_.object_parts.push_back(part_record(sphere.center, sphere.radius, sphere.material));
        accel.parts.push_back(accel_part(sphere.center, sphere.radius, sphere.material));
      }
      if (accel.parts.empty()) continue;
      accel_object[i] = std::uint32_t(accel_input_.objects.size());
      accel_input_.objects.push_back(std::move(accel));
    }
    for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
      const Instance& instance = scene_.instances[i];
      const std::size_t object = std::size_t(instance.object);
      if (accel_object[object] == kNoHit) continue;
      add_instance(instance, accel_object[object], first_part[object], i);
    }
  }

  void add_instance(const Instance& instance, std::uint32_t accel_object, std::uint32_t first_part, std::size_t index) {
    InstanceRecord record;
    record.first_part = first_part;
    const Linear linear(instance.to_world), normals = linear.normal_transform();
    const V3d translation =
        V3d(instance.to_world[3][0], instance.to_world[3][1], instance.to_world[3][2]) - data_.origin;
    // Cofactors scale with the square of the transform: bring them to order one before they become float.
    const double scale = 1 / std::max({length(normals.x), length(normals.y), length(normals.z)});
    const V3d columns[4] = {linear.x, linear.y, linear.z, translation};
    for (int c = 0; c < 4; ++c) {
      for (int r = 0; r < 3; ++r) record.to_world[3 * c + r] = float(columns[c][r]);
    }
    const V3d normal_columns[3] = {normals.x * scale, normals.y * scale, normals.z * scale};
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) record.normal_to_world[3 * c + r] = float(normal_columns[c][r]);
    }
    record.offset_scale = float(length(linear.x) + length(linear.y) + length(linear.z));
    record.offset =
        float(std::max({std::abs(translation.x), std::abs(translation.y), std::abs(translation.z)})) * kOffsetFactor;
    add_instance_emitters(record, linear, scene_.objects[std::size_t(instance.object)]);

    AccelInstance accel;
    accel.object = accel_object;
    std::memcpy(accel.to_world, record.to_world, sizeof(accel.to_world));
    accel_input_.instances.push_back(accel);
    data_.instances.push_back(record);
    data_.instance_names.push_back(std::uint32_t(index));
  }

  void add_instance_emitters(InstanceRecord& record, const Linear& linear, const Object& object) {
    std::vector<std::uint32_t> slots;
    bool any = false;
    for (const TriangleMesh& mesh : object.meshes) {
      if (mesh.indices.empty()) continue;
      slots.push_back(add_emitters(
          mesh, [&](const V3f& p) { return record.point(p); }, linear.determinant() < 0));
      any = any || slots.back() != kNoHit;
    }
    for (const Sphere& sphere : object.spheres) {
      slots.push_back(add_emitter(sphere_emitter(sphere, record, linear), sphere.material));
      any = any || slots.back() != kNoHit;
    }
    if (!any) return;
    record.first_emitter_slot = std::uint32_t(data_.instance_emitters.size());
    data_.instance_emitters.insert(data_.instance_emitters.end(), slots.begin(), slots.end());
  }

  // A placed sphere: still one where it only grows, moves, and turns without a texture; an ellipsoid otherwise.
  AreaEmitter sphere_emitter(const Sphere& sphere, const InstanceRecord& record, const Linear& linear) const {
    AreaEmitter emitter;
    emitter.p0 = record.point(sphere.center);
    const double scale = linear.uniform_scale();
    const bool textured = has_orientation(scene_.materials[std::size_t(sphere.material)]);
    if (scale > 0 && !(textured && turns(linear))) {
      emitter.shape = AreaEmitter::Shape::sphere;
      emitter.e1 = V3f(float(sphere.radius * scale), 0, 0);
      return emitter;
    }
    emitter.shape = AreaEmitter::Shape::ellipsoid;
    emitter.e1 = record.direction(V3f(sphere.radius, 0, 0));
    emitter.e2 = record.direction(V3f(0, sphere.radius, 0));
    emitter.e3 = record.direction(V3f(0, 0, sphere.radius));
    return emitter;
  }

  template <class ToWorld>
  std::uint32_t add_emitters(const TriangleMesh& mesh, const ToWorld& to_world, bool mirrored = false) {
    const Material& material = scene_.materials[std::size_t(mesh.material)];
    const MaterialRecord& record = data_.materials[std::size_t(mesh.material)];
    if (!record.emissive || record.unlit) return kNoHit;
    const std::uint32_t first = std::uint32_t(light_input_.areas.size());
    const std::vector<V2f>* uvs = texture_coordinates(mesh, material.emission_texture);
    const std::vector<V2f>* alpha_uvs = texture_coordinates(mesh, alpha_slot(material));
    const bool alpha = has_alpha(material, &mesh, *data_.textures);
    for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
      const std::uint32_t* i = &mesh.indices[3 * t];
      AreaEmitter emitter{};
      emitter.two_sided = record.double_sided;
      emitter.p0 = to_world(mesh.positions[i[0]]);
      emitter.e1 = to_world(mesh.positions[i[1]]) - emitter.p0;
      emitter.e2 = to_world(mesh.positions[i[2]]) - emitter.p0;
      emitter.normal = unit_or_zero(V3d(cross(emitter.e1, emitter.e2)) * (mirrored ? -1.0 : 1.0));
      emitter.radiance = record.emission;
      emitter.texture = material.emission_texture;
      for (int k = 0; k < 3; ++k) emitter.uv[k] = uvs ? (*uvs)[i[k]] : V2f(0, 0);
      if (alpha) {
        EmitterAlpha& a = add_alpha(emitter, material);
        for (int k = 0; k < 3; ++k) {
          a.uv[k] = alpha_uvs ? (*alpha_uvs)[i[k]] : V2f(0, 0);
          if (!mesh.colors.empty()) a.factor[k] *= mesh.colors[i[k]].w;
        }
      }
      light_input_.areas.push_back(emitter);
    }
    return first;
  }

  // Null where the slot has no texture or the mesh no coordinates for it.
  static const std::vector<V2f>* texture_coordinates(const TriangleMesh& mesh, const TextureSlot& slot) {
    if (!slot.present() || slot.texcoord >= kMaxTexcoordSets) return nullptr;
    const std::vector<V2f>& uvs = mesh.texcoords[std::size_t(slot.texcoord)];
    return uvs.empty() ? nullptr : &uvs;
  }

  EmitterAlpha& add_alpha(AreaEmitter& emitter, const Material& material) {
    emitter.alpha = std::uint32_t(light_input_.alphas.size());
    EmitterAlpha& alpha = light_input_.alphas.emplace_back();
    alpha.texture = alpha_slot(material);
    for (float& factor : alpha.factor) factor = material.base_alpha;
    alpha.mask = material.alpha_mode == AlphaMode::mask;
    alpha.cutoff = material.alpha_cutoff;
    return alpha;
  }

  // Everything but the shape is filled in.
  std::uint32_t add_emitter(AreaEmitter emitter, int material_index) {
    const Material& material = scene_.materials[std::size_t(material_index)];
    const MaterialRecord& record = data_.materials[std::size_t(material_index)];
    if (!record.emissive || record.unlit) return kNoHit;
    emitter.two_sided = record.double_sided;
    emitter.radiance = record.emission;
    emitter.texture = material.emission_texture;
    if (has_alpha(material, nullptr, *data_.textures)) add_alpha(emitter, material);
    light_input_.areas.push_back(emitter);
    return std::uint32_t(light_input_.areas.size() - 1);
  }

  void make_lights() {
    light_input_.punctual = scene_.lights;
    for (PunctualLight& light : light_input_.punctual) light.position -= data_.origin;
    if (scene_.environment) {
      light_input_.environment = &*scene_.environment;
      if (scene_.environment->image >= 0) {
        light_input_.env_distribution =
            std::make_shared<EnvironmentDistribution>(EnvironmentMap(*scene_.environment, &*data_.textures));
      }
    }
    light_input_.textures = &*data_.textures;
    light_input_.scene_bounds = data_.world_bounds.isEmpty() ? Box3f(V3f(0, 0, 0), V3f(0, 0, 0))
                                                             : Box3f(V3f(data_.world_bounds.min - data_.origin),
                                                                     V3f(data_.world_bounds.max - data_.origin));
    light_input_.use_tree = data_.features.light_tree;
    data_.lights = std::make_unique<LightSampler>(std::move(light_input_));
  }

  // All but the BVH of the meshes and the environment's map.
  std::uint64_t resident_bytes() const {
    return memory_.description + memory_.instances + data_.textures->memory_bytes() + data_.lights->memory_bytes();
  }

  void count() {
    RenderSceneStats& stats = data_.stats;
    std::vector<std::uint64_t> triangles;
    for (const Object& object : scene_.objects) {
      std::uint64_t n = 0;
      for (const TriangleMesh& mesh : object.meshes) n += mesh.triangle_count();
      stats.triangles += n;
      triangles.push_back(n);
    }
    for (const Instance& instance : scene_.instances)
      stats.instanced_triangles += triangles[std::size_t(instance.object)];
    const int map = scene_.environment ? scene_.environment->image : -1;
    const std::uint64_t map_bytes = map >= 0 ? scene_.images[std::size_t(map)].bytes() : 0;
    stats.memory_bytes = memory_.description + map_bytes + data_.instances.size() * sizeof(InstanceRecord) +
                         data_.textures->memory_bytes() + data_.lights->memory_bytes() + data_.accel->memory_bytes();
  }

  SceneData& data_;
  SceneDescription& scene_;
  BuildMemory memory_;
  std::vector<Box3d> boxes_;  // of objects
  std::vector<std::uint32_t> uses_;
  std::vector<bool> baked_;
  bool widen_ = false;
  AccelInput accel_input_;
  LightSampler::Input light_input_;
};

}  // namespace

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
Box3d RenderScene::world_bounds() const {
  return impl_->world_bounds;
}

}  // namespace helio
