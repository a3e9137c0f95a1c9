#include "renderer/trace/scene/edit_scene.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <set>
#include <utility>

#include "renderer/base/camera_limits.h"
#include "renderer/base/clock.h"
#include "renderer/scene/images/environment.h"
#include "renderer/trace/scene/build_memory.h"
#include "renderer/trace/scene/float_resolution.h"
#include "renderer/trace/scene/light_gathering.h"
#include "renderer/trace/scene/placement.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {
namespace {

// A transform may stretch an object so much more along one direction than the object grows: its vertices are floats of
// the space in which it was baked, and what was pressed flat there has lost its shape.
constexpr double kMaxStretch = 1e4;

// Of the radius up to which a scene stays widened: it is measured in two ways, from the box's diagonal and its corners.
constexpr float kSameRadius = 1 + 1e-5f;

double largest_corner(const Box3d& box, const V3d& origin) {
  const V3d low = box.min - origin, high = box.max - origin;
  return length(V3d(std::max(std::abs(low.x), std::abs(high.x)), std::max(std::abs(low.y), std::abs(high.y)),
                    std::max(std::abs(low.z), std::abs(high.z))));
}

// From the rebased world in which an object was baked to the one where it stands at `to_world`.
M44d relative_placement(const M44d& baked_to_world, const M44d& to_world, const V3d& origin) {
  if (baked_to_world == to_world) return M44d();
  M44d back;
  back.setTranslation(origin);
  return rebased(back * baked_to_world.inverse() * to_world, origin);
}

}  // namespace

// One edit: copies what belongs to a snapshot alone, applies the changes, builds what they make necessary.
class SceneEditor {
 public:
  SceneEditor(const std::shared_ptr<const RenderScene>& base, const SceneChanges& changes, const EditOptions& options)
      : base_(base), old_(base->impl()), changes_(changes), options_(options) {}

  Result<std::shared_ptr<const RenderScene>> run() {
    const double begin = now_s();
    copy();
    apply_materials();
    apply_lights();
    if (Status placed = place(); !placed) return placed.error();
    update_features(data_->description, data_->assets->material_uses, data_->features);
    if (Status fits = check_lights(); !fits) return fits.error();
    if (cancelled()) return cancelled_error();
    for (const auto& [index, change] : changes_.materials) {
      prepare_material_tables(data_->description.materials[index], data_->features);
    }
    gather_lights(*data_, data_->features.area_lights ? data_->features.light_count : 0);
    if (cancelled()) return cancelled_error();
    if (Status traced = make_accel(); !traced) return traced.error();
    if (!changes_.transforms.empty()) {
      data_->description.report.notices = find_unresolved_views(*data_);
    }
    count_memory(*data_);
    count_own();
    data_->stats.build_seconds = now_s() - begin;
    return std::shared_ptr<const RenderScene>(new RenderScene(std::move(data_)));
  }

 private:
  bool cancelled() const { return options_.cancel && options_.cancel->cancelled(); }
  static Error cancelled_error() { return {ErrorCode::cancelled, "the edit was cancelled", {}}; }

  void copy() {
    data_->description = old_.description;
    data_->description.report = {};
    data_->features = old_.features;
    data_->stats = old_.stats;
    data_->origin = old_.origin;
    data_->world_bounds = old_.world_bounds;
    data_->radius = old_.radius;
    data_->assets = old_.assets;
    data_->textures = old_.textures;
    data_->mip_mapped = old_.mip_mapped;
    data_->materials = old_.materials;
    data_->flat = old_.flat;
    data_->object_parts = old_.object_parts;
    data_->instances = old_.instances;
    data_->flat_names = old_.flat_names;
    data_->instance_names = old_.instance_names;
    data_->taken_out = old_.taken_out;
    data_->environment_table = old_.environment_table;
    summary().parent = base_;
  }

  EditSummary& summary() {
    if (!data_->edit) data_->edit.emplace();
    return *data_->edit;
  }

  void apply_materials() {
    for (const auto& [index, change] : changes_.materials) {
      Material& material = data_->description.materials[index];
      set_material_values(change.to, material);
      data_->materials[index] = make_material_record(material);
      // What an unlit surface shows is its colour, and no light of the scene comes from it.
      const bool surface =
          change.from.base_color != change.to.base_color || change.from.roughness != change.to.roughness;
      if (surface) summary().materials.push_back(index);
      if (change.from.emission != change.to.emission) summary().emissions.push_back(index);
    }
  }

  void apply_lights() {
    for (const auto& [index, change] : changes_.lights) {
      data_->description.lights[index].intensity = change.to;
      summary().lights.push_back(index);
    }
    if (!changes_.environment) return;
    data_->description.environment->radiance = changes_.environment->to;
    summary().environment = true;
  }

  Status check_lights() const {
    const std::uint64_t count = data_->features.light_count;
    if (count >= kMaxEmitters) {
      return Error{ErrorCode::resource_exhausted,
                   fmt::format("{} lights, emissive triangles of all instances counted; allowed: fewer than {}", count,
                               kMaxEmitters),
                   "lights"};
    }
    if (data_->features.area_lights && emitter_bytes(count) > options_.max_bytes) {
      return Error{
          ErrorCode::resource_exhausted,
          fmt::format("{} lights need {} bytes where {} are left", count, emitter_bytes(count), options_.max_bytes),
          "lights"};
    }
    return hold();
  }

  // All but the BVH, which counts itself: records and names again, light tables at their largest, and a new table of
  // the environment map where its colour changes.
  Status hold() const {
    if (!options_.ledger) return ok_status();
    const auto& map = old_.environment_table.distribution;
    const std::uint64_t bytes = old_.table_bytes +
                                (data_->features.area_lights ? emitter_bytes(data_->features.light_count) : 0) +
                                (changes_.environment && map ? map->memory_bytes() : 0);
    if (options_.ledger->grow(bytes)) return ok_status();
    return options_.ledger->refusal(bytes, "the edited scene");
  }

  // ---- moved objects ------------------------------------------------------------------------------------------------

  const Box3d& box_of(std::uint32_t name) const {
    return data_->assets->boxes[std::size_t(data_->description.instances[name].object)];
  }
  bool is_baked(std::uint32_t name) const {
    return data_->assets->baked[std::size_t(data_->description.instances[name].object)];
  }
  std::string where(std::uint32_t name) const {
    return fmt::format("object {} '{}'", name, data_->description.instances[name].name);
  }

  Status place() {
    if (changes_.transforms.empty()) return ok_status();
    for (const auto& [name, change] : changes_.transforms) {
      if (!is_usable_transform(change.to)) {
        return Error{ErrorCode::invalid_argument,
                     "its transform flattens it to nothing; allowed: a volume of more than 1e-12 of the product of its "
                     "axes",
                     where(name)};
      }
      if (!is_in_range(box_of(name), change.to)) {
        return Error{ErrorCode::invalid_argument, fmt::format("it would reach beyond {}", kCoordinateRange),
                     where(name)};
      }
      Instance& instance = data_->description.instances[name];
      summary().moves.push_back(
          {name, transform_box(box_of(name), instance.to_world), transform_box(box_of(name), change.to)});
      instance.to_world = change.to;
      note_moved_lights(data_->assets->objects[std::size_t(instance.object)]);
    }
    measure_bounds();
    return place_records();
  }

  // A lamp that moves changes light everywhere, as one whose emission does.
  void note_moved_lights(const Object& object) {
    std::set<std::uint32_t> shining(summary().emissions.begin(), summary().emissions.end());
    const auto note = [&](int material) {
      if (data_->materials[std::size_t(material)].emissive) shining.insert(std::uint32_t(material));
    };
    for (const TriangleMesh& mesh : object.meshes) note(mesh.material);
    for (const Sphere& sphere : object.spheres) note(sphere.material);
    summary().emissions.assign(shining.begin(), shining.end());
  }

  void measure_bounds() {
    Box3d world;
    for (const Instance& instance : data_->description.instances) {
      const Box3d box = transform_box(data_->assets->boxes[std::size_t(instance.object)], instance.to_world);
      if (!box.isEmpty()) world.extendBy(box);
    }
    data_->world_bounds = world;
    if (!world.isEmpty()) data_->radius = float(largest_corner(world, data_->origin));
  }

  Status place_records() {
    std::set<std::uint32_t> baked;  // that are or will be taken out
    for (const TakenOut& object : data_->taken_out) baked.insert(object.name);
    for (const auto& [name, change] : changes_.transforms) {
      if (is_baked(name) && baked.insert(name).second) take_out(name);
    }
    std::sort(data_->taken_out.begin(), data_->taken_out.end(),
              [](const TakenOut& a, const TakenOut& b) { return a.name < b.name; });
    // The loaded instances keep their numbers; those of objects that were taken out follow.
    const std::size_t loaded = data_->instances.size() - old_.taken_out.size();
    for (std::size_t i = 0; i < loaded; ++i) {
      const auto change = changes_.transforms.find(data_->instance_names[i]);
      if (change == changes_.transforms.end()) continue;
      set_placement(data_->instances[i], rebased(change->second.to, data_->origin));
    }
    data_->instances.resize(loaded);
    data_->instance_names.resize(loaded);
    for (const TakenOut& object : data_->taken_out) {
      const M44d& to_world = data_->description.instances[object.name].to_world;
      const M44d placement = relative_placement(object.baked_to_world, to_world, data_->origin);
      if (Status fits = check_stretch(object, placement, to_world); !fits) return fits;
      InstanceRecord record;
      record.first_part = object.first_part;
      record.part_count = object.part_count;
      record.accel_object = object.accel_object;
      set_placement(record, placement);
      data_->instances.push_back(record);
      data_->instance_names.push_back(object.name);
    }
    return check_traceable();
  }

  // The parts of an object that was baked, as those of an instance. Objects without any stay as they are.
  void take_out(std::uint32_t name) {
    TakenOut object;
    object.name = name;
    object.baked_to_world = old_.description.instances[name].to_world;
    object.first_part = std::uint32_t(data_->object_parts.size());
    object.accel_object = std::uint32_t(old_.accel->object_count() + new_objects_.size());
    AccelObject accel;
    for (std::size_t i = 0; i < data_->flat.size(); ++i) {
      if (data_->flat_names[i] != name) continue;
      const PartRecord& part = data_->flat[i];
      const Material& material = data_->description.materials[part.material];
      if (part.mesh) {
        data_->object_parts.push_back(part_record(*part.mesh));
        accel.parts.push_back(accel_part(*part.mesh, material, *data_->textures));
      } else {
        data_->object_parts.push_back(part_record(part.center, part.radius, part.material));
        accel.parts.push_back(accel_part(part.center, part.radius, material, *data_->textures));
      }
    }
    object.part_count = std::uint32_t(accel.parts.size());
    if (accel.parts.empty()) return;
    new_objects_.push_back(std::move(accel));
    data_->taken_out.push_back(object);
  }

  Status check_stretch(const TakenOut& object, const M44d& placement, const M44d& to_world) const {
    const Box3d& box = box_of(object.name);
    if (box.isEmpty()) return ok_status();
    const double before = length(transform_box(box, object.baked_to_world).size());
    const double after = length(transform_box(box, to_world).size());
    const Linear linear(placement);
    const double longest = std::max({length(linear.x), length(linear.y), length(linear.z)});
    if (!(longest * before > kMaxStretch * after)) return ok_status();
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("it was loaded pressed flat, and its transform pulls it apart {:.3g} times as much along one "
                    "direction as it grows; allowed: at most {:g} times. Load the scene with this transform",
                    longest * before / after, kMaxStretch),
        where(object.name)};
  }

  Status check_traceable() const {
    for (std::size_t i = 0; i < data_->instances.size(); ++i) {
      const std::uint32_t name = data_->instance_names[i];
      const M44d& to_world = data_->description.instances[name].to_world;
      const auto object = std::find_if(data_->taken_out.begin(), data_->taken_out.end(),
                                       [&](const TakenOut& taken) { return taken.name == name; });
      const M44d placement = object == data_->taken_out.end()
                                 ? rebased(to_world, data_->origin)
                                 : relative_placement(object->baked_to_world, to_world, data_->origin);
      if (is_traceable(placement, double(data_->radius))) continue;
      return Error{ErrorCode::invalid_argument,
                   fmt::format("it is too small for a scene of radius {:.3g}: rays could not be traced in its space",
                               data_->radius),
                   where(name)};
    }
    return ok_status();
  }

  // ---- the BVH ------------------------------------------------------------------------------------------------------

  Status make_accel() {
    if (changes_.transforms.empty()) {
      data_->accel = Accel::share(*old_.accel, data_.get());
      summary().shares_bvh = true;
      return ok_status();
    }
    AccelEdit edit;
    edit.taken_out.assign(data_->flat.size(), false);
    for (std::size_t i = 0; i < data_->flat.size(); ++i) edit.taken_out[i] = data_->is_taken_out(i);
    edit.new_objects = std::move(new_objects_);
    for (const InstanceRecord& record : data_->instances) edit.instances.push_back(accel_instance(record));
    // Triangles are widened for rays that stay within a few radii of the scene as it was loaded.
    const float widened_radius = old_.accel->built_edge_dilation_radius();
    edit.robust = !(data_->radius <= widened_radius * kSameRadius);
    edit.threads = options_.threads;
    edit.max_bytes = std::size_t(options_.max_bytes);
    edit.cancel = options_.cancel;
    edit.ledger = options_.ledger;
    auto accel = Accel::edit(*old_.accel, edit, data_.get());
    if (!accel) return std::move(accel).error();
    data_->accel = std::move(*accel);

    const float edge_dilation = data_->accel->edge_dilation_radius();
    data_->features.fast_rays = edge_dilation > 0;
    data_->features.instances |= !data_->instances.empty();
    if (edge_dilation != old_.accel->edge_dilation_radius()) set_flat_offsets(*data_, edge_dilation);
    for (InstanceRecord& record : data_->instances) record.offset += edge_dilation_offset(edge_dilation);
    return ok_status();
  }

  void count_own() {
    std::set<const void*> before;
    for (const MemoryShare& share : base_->memory()) before.insert(share.what.get());
    data_->stats.own_bytes = data_->table_bytes;
    if (const auto& table = data_->environment_table.distribution; table && !before.contains(table.get())) {
      data_->stats.own_bytes += table->memory_bytes();
    }
    for (const AccelShare& share : data_->accel->shares()) {
      if (!before.contains(share.what.get())) data_->stats.own_bytes += share.bytes;
    }
  }

  const std::shared_ptr<const RenderScene>& base_;
  const SceneData& old_;
  const SceneChanges& changes_;
  const EditOptions& options_;
  std::unique_ptr<SceneData> data_ = std::make_unique<SceneData>();
  std::vector<AccelObject> new_objects_;
};

Result<std::shared_ptr<const RenderScene>> edit_scene(const std::shared_ptr<const RenderScene>& base,
                                                      const SceneChanges& changes, const EditOptions& options) {
  return SceneEditor(base, changes, options).run();
}

}  // namespace helio
