// How much light a rough reflection lobe returns: trace/bsdf/microfacet_albedo.h, looked up in the same tables.
#ifndef MICROFACET_ALBEDO_GLSL
#define MICROFACET_ALBEDO_GLSL

#include "bsdf/microfacet.glsl"

// AlbedoTerms of trace/bsdf/microfacet_albedo.h.
struct AlbedoTerms {
  float a, b, s, loss;
};

float entering_share(AlbedoTerms terms, float f0, float f90) {
  const float first = f0 + (f90 - f0) * terms.s;
  return max(0.0, 1 - first + (1 - f0) * (first - (f0 * terms.a + f90 * terms.b)));
}

struct CellPosition {
  uint index;
  float t;
};

CellPosition locate_cell(float coordinate, uint nodes) {
  const float x = clamp(coordinate, 0.0, 1.0) * float(nodes - 1);
  const uint index = min(uint(x), nodes - 2);
  return CellPosition(index, x - float(index));
}

float fourth_root(float x) {
  return sqrt(safe_sqrt(x));
}

// Row 0 is the mirror, row 1 the smoothest rough surface.
CellPosition locate_alpha(float alpha) {
  const float kLeastRoot = 0.17782794100389228;  // of kDeltaAlpha
  const float root = fourth_root(alpha);
  if (root < kLeastRoot) return CellPosition(0, root / kLeastRoot);
  CellPosition position = locate_cell((root - kLeastRoot) / (1 - kLeastRoot), kAlbedoAlphaNodes - 1);
  ++position.index;
  return position;
}

AlbedoTerms albedo_terms_of(vec4 v) {
  return AlbedoTerms(v.x, v.y, v.z, v.w);
}

AlbedoTerms directional_albedo(uint64_t table, float alpha, float mu) {
  AlbedoBuffer albedo = AlbedoBuffer(table);
  const CellPosition row = locate_alpha(alpha), column = locate_cell(fourth_root(mu), kAlbedoMuNodes);
  const uint low = row.index * kAlbedoMuNodes + column.index, high = low + kAlbedoMuNodes;
  const vec4 low_first = albedo.table.directional[low], high_first = albedo.table.directional[high];
  const vec4 at_low = low_first + (albedo.table.directional[low + 1] - low_first) * column.t;
  const vec4 at_high = high_first + (albedo.table.directional[high + 1] - high_first) * column.t;
  return albedo_terms_of(at_low + (at_high - at_low) * row.t);
}

AlbedoTerms mean_albedo(uint64_t table, float alpha) {
  AlbedoBuffer albedo = AlbedoBuffer(table);
  const CellPosition row = locate_alpha(alpha);
  const vec4 low = albedo.table.mean[row.index];
  return albedo_terms_of(low + (albedo.table.mean[row.index + 1] - low) * row.t);
}

// What is lost below node i, for the alpha that `row` locates.
float lost_below(AlbedoBuffer albedo, CellPosition row, uint i) {
  const uint at = row.index * kAlbedoMuNodes + i;
  const float low = albedo.table.lost_below[at];
  return low + (albedo.table.lost_below[at + kAlbedoMuNodes] - low) * row.t;
}

// Squared cosine of a node.
float squared_node(uint i) {
  return sqr(sqr(sqr(float(i) / float(kAlbedoMuNodes - 1))));
}

const float kByLoss = 0.875;  // share of directions that follow the loss

float sample_loss_cosine(uint64_t table, float alpha, float u) {
  if (u >= kByLoss) return sqrt((u - kByLoss) / (1 - kByLoss));
  AlbedoBuffer albedo = AlbedoBuffer(table);
  const CellPosition row = locate_alpha(alpha);
  const float wanted = u / kByLoss * lost_below(albedo, row, kAlbedoMuNodes - 1);
  uint cell = 0, end = kAlbedoMuNodes - 1;
  while (end - cell > 1) {
    const uint middle = (cell + end) / 2;
    if (lost_below(albedo, row, middle) <= wanted) cell = middle;
    else end = middle;
  }
  const float below = lost_below(albedo, row, cell);
  const float lost = lost_below(albedo, row, cell + 1) - below;
  const float t = lost > 0 ? clamp((wanted - below) / lost, 0.0, 1.0) : 0.5;
  return sqrt(squared_node(cell) + (squared_node(cell + 1) - squared_node(cell)) * t);
}

float loss_pdf_w(uint64_t table, float alpha, float mu) {
  AlbedoBuffer albedo = AlbedoBuffer(table);
  const CellPosition row = locate_alpha(alpha);
  const uint cell = locate_cell(fourth_root(mu), kAlbedoMuNodes).index;
  const float squares = squared_node(cell + 1) - squared_node(cell);
  const float all = lost_below(albedo, row, kAlbedoMuNodes - 1);
  const float by_loss =
      all > 0 ? (lost_below(albedo, row, cell + 1) - lost_below(albedo, row, cell)) / (all * squares) : 1.0;
  return (kByLoss * by_loss + (1 - kByLoss)) * mu * kInvPi;
}

#endif
