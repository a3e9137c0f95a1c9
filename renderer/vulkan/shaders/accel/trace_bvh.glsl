// Rays in our own BVH: intersect() and occluded() in plain GLSL. Include after the push constants (scene.glsl).
//
// No ray slips between triangles that share an edge (triangle_hit.glsl): boxes are widened by what rounding may take
// from them or move a triangle by (Ize 2013, "Robust BVH Ray Traversal").
#ifndef TRACE_BVH_GLSL
#define TRACE_BVH_GLSL

#include "scene/alpha.glsl"
#include "scene/geometry.glsl"
#include "accel/ray_range.glsl"
#include "accel/sphere_hit.glsl"
#include "accel/triangle_hit.glsl"

// GeometryTables::features as a constant: compilers leave out the code for the rest.
layout(constant_id = 0) const uint kTraceFeatures = 0xffffffffu;

// Nodes and triangles, in words of 64 bits: software devices load word by word.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer BvhWords {
  u64vec2 at[];
};
uvec4 words_of(u64vec2 pair) {
  return uvec4(unpackUint2x32(pair.x), unpackUint2x32(pair.y));
}

// A ray in the space of the tree that it is in.
struct TreeRay {
  vec3 origin, direction;
  vec3 inverse;     // 1 / direction, finite
  vec3 from_near;   // the origin, moved ahead for faces where the ray enters boxes and back where it leaves: boxes grow
  vec3 from_far;
  RayShear shear;
};

// The box and the triangle test together err by less than 16 x 2^-24 of the largest distance on any axis.
const float kBoxSlack = 1.0 / 1048576.0;

TreeRay make_tree_ray(vec3 origin, vec3 direction, float extent) {
  TreeRay ray;
  ray.origin = origin;
  ray.direction = direction;
  const vec3 size = abs(direction);
  const float largest = max(size.x, max(size.y, size.z));
  // Along an axis where the ray stands still only the sign of the distance to a face counts.
  const float least = largest * (1.0 / 1152921504606846976.0);
  ray.inverse = 1.0 / vec3(size.x < least ? copysign(least, direction.x) : direction.x,
                           size.y < least ? copysign(least, direction.y) : direction.y,
                           size.z < least ? copysign(least, direction.z) : direction.z);
  const vec3 reach = abs(origin);
  const float slack = kBoxSlack * (max(reach.x, max(reach.y, reach.z)) + extent);
  const vec3 ahead = vec3(copysign(slack, direction.x), copysign(slack, direction.y), copysign(slack, direction.z));
  ray.from_near = origin + ahead;
  ray.from_far = origin - ahead;
  ray.shear = make_ray_shear(direction);
  return ray;
}

// Where the ray enters the boxes of a node's children; kInfinity: it misses one, or enters it beyond t_max. `head`,
// `bounds` and `rest`: the first, third and fourth quarter of the node.
vec4 enter_children(TreeRay ray, uvec4 head, uvec4 bounds, uvec2 rest, float t_max) {
  const uvec3 lower = bounds.xyz, upper = uvec3(bounds.w, rest);
  const uvec3 near = uvec3(ray.inverse.x < 0 ? upper.x : lower.x, ray.inverse.y < 0 ? upper.y : lower.y,
                           ray.inverse.z < 0 ? upper.z : lower.z);
  const uvec3 far = lower ^ upper ^ near;
  const vec3 unit = uintBitsToFloat(uvec3(head.w << 23, head.w << 15, head.w << 7) & 0x7f800000u) * ray.inverse;
  const vec3 origin = uintBitsToFloat(head.xyz);
  const vec3 from_near = (origin - ray.from_near) * ray.inverse, from_far = (origin - ray.from_far) * ray.inverse;
  vec4 t;
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const vec3 first = vec3(ivec3((near >> 8 * i) & 255u)) * unit + from_near;
    const vec3 last = vec3(ivec3((far >> 8 * i) & 255u)) * unit + from_far;
    const float enter = max(max(first.x, first.y), max(first.z, 0.0));
    const float leave = min(min(last.x, last.y), min(last.z, t_max));
    t[i] = enter <= leave ? enter : kInfinity;
  }
  return t;
}

// Puts the nearer of two children first.
void sort_children(inout float ta, inout float tb, inout uint a, inout uint b) {
  const bool turn = tb < ta;
  const float t = turn ? tb : ta;
  const uint reference = turn ? b : a;
  tb = turn ? ta : tb;
  b = turn ? a : b;
  ta = t;
  a = reference;
}

// What a traversal has found.
struct BvhHit {
  float t, u, v;
  uint triangle;  // index of the BvhTriangle; kNone: nothing
  uint instance;
};

BvhTriangle bvh_triangle(uint index) {
  BvhWords words = BvhWords(scene.geometry.bvh_triangles);
  const uvec4 w0 = words_of(words.at[3 * index]), w1 = words_of(words.at[3 * index + 1]);
  const uvec4 w2 = words_of(words.at[3 * index + 2]);
  return BvhTriangle(uintBitsToFloat(w0.xyz), w0.w, uintBitsToFloat(w1.xyz), w1.w, uintBitsToFloat(w2.xyz), w2.w);
}

// Tests the triangle or sphere `index` of a leaf. True: it is hit before best.t, and is in `best`.
bool test_leaf_triangle(TreeRay ray, uint index, uint instance, uint alpha_key, inout BvhHit best) {
  const BvhTriangle triangle = bvh_triangle(index);
  const uint part = triangle.part & kBvhPartMask;
  const bool alpha = (kTraceFeatures & kTraceAlpha) != 0 && (triangle.part & kBvhAlpha) != 0;
  if ((kTraceFeatures & kTraceSpheres) != 0 && (triangle.part & kBvhSphere) != 0) {
    const SphereHit sphere = meet_sphere(ray.origin, ray.direction, triangle.a, triangle.b.x);
    if (sphere.half_length < 0) return false;
    for (int side = 0; side < 2; ++side) {
      const float t = sphere.middle + (side == 0 ? -sphere.half_length : sphere.half_length);
      if (!(t >= 0 && t < best.t)) continue;
      if (alpha && !opaque_at(part, instance, triangle.primitive, vec2(0),
                              sphere_normal(sphere, ray.direction, side == 0), side == 0, alpha_key))
        continue;
      best = BvhHit(t, 0, 0, index, instance);
      return true;
    }
    return false;
  }
  vec3 hit;
  if (!meet_triangle(ray.origin, ray.shear, triangle.a, triangle.b, triangle.c, best.t, hit)) return false;
  // On triangles neither the normal nor the side that is hit decides.
  if (alpha && !opaque_at(part, instance, triangle.primitive, hit.yz, vec3(0), true, alpha_key)) return false;
  best = BvhHit(hit.x, hit.y, hit.z, index, instance);
  return true;
}

TreeRay ray_in_instance(Ray ray, uint instance) {
  const InstanceTable table = instance_at(instance);
  const vec3 o = ray.origin - table.to_world[3], d = ray.direction;
  const vec3 origin = table.to_object[0] * o.x + table.to_object[1] * o.y + table.to_object[2] * o.z;
  const vec3 direction = table.to_object[0] * d.x + table.to_object[1] * d.y + table.to_object[2] * d.z;
  return make_tree_ray(origin, direction, table.bvh_slack);
}

// The closest hit, or with `any_hit` some hit, before ray.t_max. One turn of the loop visits a node or tests one
// triangle: lanes that run in step then wait least for each other.
BvhHit traverse(Ray ray, const bool any_hit) {
  BvhHit best = BvhHit(ray.t_max, 0, 0, kNone, kNone);
  BvhWords nodes = BvhWords(scene.geometry.bvh_nodes);
  TreeRay tree = make_tree_ray(ray.origin, ray.direction, scene.geometry.bvh_slack);
  uint stack[kBvhStackSize];
  float distances[kBvhStackSize];  // where the ray enters what is on the stack
  int height = 0;
  uint instance = kNone;
  int instance_height = 0;  // of the stack where the ray entered the instance
  uint reference = scene.geometry.bvh_root;
  for (;;) {
    bool pop;
    if ((reference & kBvhLeaf) == 0) {
      const uvec4 head = words_of(nodes.at[4 * reference]), bounds = words_of(nodes.at[4 * reference + 2]);
      const uvec2 rest = words_of(nodes.at[4 * reference + 3]).xy;
      uvec4 child = words_of(nodes.at[4 * reference + 1]);
      vec4 t = enter_children(tree, head, bounds, rest, best.t);
      sort_children(t.x, t.y, child.x, child.y);
      sort_children(t.z, t.w, child.z, child.w);
      sort_children(t.x, t.z, child.x, child.z);
      sort_children(t.y, t.w, child.y, child.w);
      sort_children(t.y, t.z, child.y, child.z);
      if (t.w < kInfinity) {
        distances[height] = t.w;
        stack[height++] = child.w;
      }
      if (t.z < kInfinity) {
        distances[height] = t.z;
        stack[height++] = child.z;
      }
      if (t.y < kInfinity) {
        distances[height] = t.y;
        stack[height++] = child.y;
      }
      reference = child.x;
      pop = t.x == kInfinity;
    } else if ((kTraceFeatures & kTraceInstances) != 0 && (reference & kBvhInstance) == kBvhInstance) {
      instance = reference & kBvhInstanceMask;
      instance_height = height;
      tree = ray_in_instance(ray, instance);
      reference = Instances(scene.geometry.instances).at[instance].bvh_root;
      pop = false;
    } else {
      const uint count = (reference >> kBvhCountShift) & kBvhCountMask;
      if (count > 0) {
        if (test_leaf_triangle(tree, reference & kBvhFirstMask, instance, ray.alpha_key, best) && any_hit) return best;
        reference += 1 - (1u << kBvhCountShift);
      }
      pop = count <= 1;
    }
    if (pop) {
      if ((kTraceFeatures & kTraceInstances) != 0 && instance != kNone && height == instance_height) {
        instance = kNone;
        tree = make_tree_ray(ray.origin, ray.direction, scene.geometry.bvh_slack);
      }
      if (height == 0) return best;
      --height;
      reference = distances[height] < best.t ? stack[height] : kBvhEmpty;
    }
  }
}

// The closest hit, as Accel::intersect().
Hit intersect(Ray ray) {
  Hit hit = no_hit(ray.t_max);
  if (!is_traceable(ray, scene.geometry.ray_limit)) return hit;
  const BvhHit found = traverse(ray, false);
  if (found.triangle == kNone) return hit;
  const BvhTriangle triangle = bvh_triangle(found.triangle);
  // The normal is made of the edges that Embree takes: the sign of a component that is 0 chooses the frame around it
  // (frame.glsl).
  hit = Hit(found.t, found.u, found.v, cross(triangle.c - triangle.a, triangle.a - triangle.b),
            triangle.part & kBvhPartMask, triangle.primitive, found.instance);
  if ((kTraceFeatures & kTraceSpheres) != 0 && (triangle.part & kBvhSphere) != 0) {
    vec3 origin = ray.origin, direction = ray.direction;
    if ((kTraceFeatures & kTraceInstances) != 0 && found.instance != kNone) {
      const TreeRay tree = ray_in_instance(ray, found.instance);
      origin = tree.origin;
      direction = tree.direction;
    }
    const SphereHit sphere = meet_sphere(origin, direction, triangle.a, triangle.b.x);
    hit.normal = sphere_normal(sphere, direction, found.t < sphere.middle);
  }
  return hit;
}

// Whether something lies on the ray before its t_max, as Accel::occluded().
bool occluded(Ray ray) {
  if (!is_traceable(ray, scene.geometry.ray_limit)) return true;
  return traverse(ray, true).triangle != kNone;
}

#endif
