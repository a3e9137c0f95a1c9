#include "renderer/film/box_sum.h"

namespace helio {
namespace {

// out[i] = in[i] + in[i + step] + ... + in[i + 6 step].
void sum_taps(const float* in, int step, int n, float* out) {
  for (int i = 0; i < n; ++i) {
    out[i] = ((in[i] + in[i + step]) + (in[i + 2 * step] + in[i + 3 * step])) +
             ((in[i + 4 * step] + in[i + 5 * step]) + in[i + 6 * step]);
  }
}

}  // namespace

void box_sum(const BoxPlane& in, int width, int height, BoxPlane& rows, BoxPlane& out) {
  const int bordered = height + 2 * kBoxRadius;
  rows.resize(width, bordered);
  for (int y = 0; y < bordered; ++y) sum_taps(in.row(y), kBoxLanes, rows.stride, rows.row(y));
  out.resize(width, height);
  for (int y = 0; y < height; ++y) sum_taps(rows.row(y), rows.stride, out.stride, out.row(y));
}

}  // namespace helio
