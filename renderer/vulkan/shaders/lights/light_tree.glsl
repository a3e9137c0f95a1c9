// Selecting one of many lights by what each may bring to a point: trace/lights/light_tree.cpp. Include after
// scene.glsl.
#ifndef LIGHT_TREE_GLSL
#define LIGHT_TREE_GLSL

#include "base/base.glsl"
#include "tables/lights.h"

const float kCosineSlack = 1e-3;
const float kMinDistanceSquared = 1e-20;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LightTreeChildren {
  LightTreeChildTable at[];
};

struct LightTreeChoice {
  uint light;
  float probability;  // 0: no light of the tree reaches the point
};

LightTreeChildren light_tree_node(uint64_t nodes, uint index) {
  return LightTreeChildren(nodes + uint64_t(index) * (64u * kLightTreeWidth));
}

// Importance of a child: intensity times the cosines of emission and at the receiver over the squared distance.
// `least_facing`: a lower bound of the cosine at the receiver, -1, or 1 where both sides of the surface matter.
float child_importance(vec4 ball, vec4 cone, vec4 emission, float spread, vec3 point, vec3 normal,
                       float least_facing) {
  const vec3 d = point - ball.xyz;
  const float squared = max(length_squared(d), kMinDistanceSquared);
  const float distance = sqrt(squared), inverse = 1.0 / distance;
  const float radius = ball.w;
  const float sin_b = min(radius * inverse, 1.0);

  // Cosine and sine of max(0, theta_w - theta_o).
  const float toward = dot(cone.xyz, d) * inverse;
  const float cos_o = cone.w, cos_w = min(max(toward, -toward - emission.y), cos_o);
  const float sin_w = safe_sqrt(1.0 - cos_w * cos_w), sin_o = safe_sqrt(1.0 - cos_o * cos_o);
  const float cos_e = cos_w * cos_o + sin_w * sin_o, sin_e = sin_w * cos_o - cos_w * sin_o;
  const float cos_r = max(-dot(normal, d) * inverse, least_facing);

  const float sent = max(cos_e, kCosineSlack) + 0.5 * sin_b;
  const float reception = max(cos_r, kCosineSlack) + 0.5 * sin_b;
  const float any = emission.z * sent * reception / (squared + spread);
  const bool emitted = max(cos_e, 0.0) + sin_e * sin_b > emission.x - kCosineSlack && cos_e + sin_b > -kCosineSlack;
  const bool received = emitted && cos_r + sin_b > -kCosineSlack;
  const bool inside = squared <= radius * radius;
  return distance - radius <= emission.w * 1.0001 && (inside || received) ? any : 0.0;
}

float least_facing(vec3 normal) {
  return length_squared(normal) > 0 ? -1.0 : 1.0;
}

// Selects a light for a point. `normal` is unit, or zero when both sides matter. u in [0, 1). Precondition: the tree is
// not empty.
LightTreeChoice select_from_tree(vec3 point, vec3 normal, float u) {
  const uint64_t nodes = scene.lights.nodes;
  const float facing = least_facing(normal);
  LightTreeChoice choice = LightTreeChoice(0, 1);
  uint at = 0;
  while ((at & kLightTreeLeaf) == 0) {
    LightTreeChildren children = light_tree_node(nodes, at);
    float importance[kLightTreeWidth];
    float sum = 0;
    [[dont_unroll]] for (uint i = 0; i < kLightTreeWidth; ++i) {
      importance[i] = child_importance(children.at[i].ball, children.at[i].cone, children.at[i].emission,
                                       children.at[i].spread, point, normal, facing);
      sum += importance[i];
    }
    const float target = u * sum;
    float below = 0, before = 0, of_chosen = 0;
    uint chosen = kNone;
    [[dont_unroll]] for (uint i = 0; i < kLightTreeWidth; ++i) {
      if (importance[i] > 0 && (chosen == kNone || target >= below)) {
        chosen = i;
        before = below;
        of_chosen = importance[i];
      }
      below += importance[i];
    }
    if (chosen == kNone) return LightTreeChoice(0, 0);
    choice.probability *= of_chosen / sum;
    u = clamp((target - before) / of_chosen, 0.0, kOneMinusEpsilon);
    at = children.at[chosen].child;
  }
  choice.light = at & ~kLightTreeLeaf;
  return choice;
}

// Probability with which select_from_tree() returns `light`, up to rounding.
float tree_probability(vec3 point, vec3 normal, uint light) {
  const uint64_t nodes = scene.lights.nodes;
  Uints node_places = Uints(scene.lights.node_places);
  const float facing = least_facing(normal);
  float probability = 1;
  uint place = Uints(scene.lights.places).at[light], at;
  do {
    at = place / kLightTreeWidth;
    LightTreeChildren children = light_tree_node(nodes, at);
    float sum = 0, mine = 0;
    [[dont_unroll]] for (uint i = 0; i < kLightTreeWidth; ++i) {
      const float importance = child_importance(children.at[i].ball, children.at[i].cone, children.at[i].emission,
                                                children.at[i].spread, point, normal, facing);
      sum += importance;
      if (i == place % kLightTreeWidth) mine = importance;
    }
    probability *= mine > 0 ? mine / sum : 0.0;
    place = node_places.at[at];
  } while (at != 0);
  return probability;
}

#endif
