// Importance sampling of an environment map: scene/images/environment_distribution.cpp. It computes in double
// where the CPU does so: environment_map_pdf_w() then finds the cell that a direction was drawn in. Include after
// scene.glsl.
#ifndef ENVIRONMENT_DISTRIBUTION_GLSL
#define ENVIRONMENT_DISTRIBUTION_GLSL

#include "base/base.glsl"
#include "base/circle.glsl"
#include "lights/environment.glsl"
#include "tables/lights.h"

// What the counts of a cumulative table add up to.
const double kTotalCount = 4294967295.0LF;

// Index of the cell that holds a count, and how far into it that lies, [0, 1).
struct EnvironmentPick {
  uint index;
  double within;
};

EnvironmentPick pick_cell(Uints cdf, uint size, float u) {
  const double x = double(u) * kTotalCount;
  const uint count = uint(min(x, kTotalCount - 1));
  uint first = 0, last = size - 1;  // the first end above `count`
  while (first < last) {
    const uint middle = (first + last) / 2;
    if (cdf.at[middle] > count) {
      last = middle;
    } else {
      first = middle + 1;
    }
  }
  const double low = first > 0 ? double(cdf.at[first - 1]) : 0.0LF;
  return EnvironmentPick(first, clamp((x - low) / (double(cdf.at[first]) - low), 0.0LF, 1.0LF));
}

Uints environment_row(uint row, uint columns) {
  return Uints(scene.lights.environment.column_cdf + uint64_t(row) * (4 * columns));
}

// Solid angle density of sample_environment_map() at the uv of a direction (environment_map_uv()). Precondition for
// both: the environment has a distribution.
float environment_map_pdf_w(vec2 uv) {
  const uint columns = scene.lights.environment.columns, rows = scene.lights.environment.rows;
  const uint column = min(uint(uv.x * float(columns)), columns - 1);
  const uint row = min(uint(uv.y * float(rows)), rows - 1);
  Uints cdf = environment_row(row, columns), row_cdf = Uints(scene.lights.environment.row_cdf);
  const uint in_row = cdf.at[column] - (column > 0 ? cdf.at[column - 1] : 0);
  const uint of_row = row_cdf.at[row] - (row > 0 ? row_cdf.at[row - 1] : 0);
  return float(in_row) * float(of_row) * Floats(scene.lights.environment.density).at[row];
}

// World direction, unit, towards the light. u in [0, 1)^2.
vec3 sample_environment_map(vec2 u) {
  const uint columns = scene.lights.environment.columns;
  const EnvironmentPick row = pick_cell(Uints(scene.lights.environment.row_cdf), scene.lights.environment.rows, u.y);
  const EnvironmentPick column = pick_cell(environment_row(row.index, columns), columns, u.x);
  Doubles row_cos = Doubles(scene.lights.environment.row_cos);
  const double top = row_cos.at[row.index], bottom = row_cos.at[row.index + 1];
  const double cos_theta = top + (bottom - top) * row.within;
  const float sin_theta = float(sqrt(max(0.0LF, (1 - cos_theta) * (1 + cos_theta))));
  const vec2 around = unit_circle(float((double(column.index) + column.within) / double(columns)));
  return environment_to_world(vec3(around.y * sin_theta, float(cos_theta), -around.x * sin_theta));
}

#endif
