// Shapes: rectangle, cube, sphere, disk, cylinder, obj, ply, serialized, shapegroup and instance.
#pragma once

#include "renderer/scene/mitsuba/context.h"

namespace helio::mitsuba {

// Adds the shape, with its bsdf and area light, to the scene. Groups are added where they are first instanced.
class ShapeReader {
 public:
  explicit ShapeReader(LoadContext& context) : context_(context) {}
  void read(const Element& element);

 private:
  struct Placed {
    int object = -1;  // < 0: failed
    M44d to_world;
  };

  Placed read_object(const Element& element);
  void fill(const Plugin& plugin, const Material& material, Object& object, M44d& to_world);
  void keep_primitive(const Plugin& plugin, TriangleMesh mesh, Object& object);
  void read_mesh_file(const Plugin& plugin, bool mirrored, TriangleMesh& mesh);
  void read_sphere(const Plugin& plugin, const Material& material, Object& object, M44d& to_world);
  void read_instance(const Plugin& plugin);
  Material read_material(const Plugin& plugin);
  // Whether the material or a part that it blends is such a one.
  template <class Has>
  bool any_part(const Material& material, const Has& has) const;
  bool is_bumped(const Material& material) const;
  // Whether its sides differ.
  bool has_front(const Material& material) const;
  void check_coordinates(const Plugin& plugin, const Material& material, const Object& object) const;
  std::string attribute_of(const Plugin& plugin) const;
  void check_attribute(const Plugin& plugin, const Object& object);
  void add_instance(const Plugin& plugin, const Placed& placed);

  LoadContext& context_;
  std::map<const Element*, std::vector<Placed>> groups_;
};

}  // namespace helio::mitsuba
