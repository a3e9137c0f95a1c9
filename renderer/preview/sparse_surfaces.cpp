#include "renderer/preview/sparse_surfaces.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "renderer/film/core/film_windows.h"
#include "renderer/trace/camera/camera_projection.h"

namespace helio {
namespace {

constexpr int kCell = 4;     // side of a cell of the lattice
constexpr int kAllowed = 2;  // of one that is interpolated
// How far a corner may lie off the plane of another, of their distance and in pixels' sides: what normals in 127ths and
// curvature that nobody sees explain.
constexpr float kTilt = 0.02f, kOffPlane = 0.25f;
constexpr int kSameFacing = int(0.95f * 127 * 127);  // cosine of their normals at least, in 127ths

constexpr float kFar = 1e12f;  // stands for the depth of what is infinitely far away

// Which pixel of 4x4 has a ray: first all of 2x2 in turn, then the other three of each four.
constexpr int kTurn[4][2] = {{0, 0}, {1, 1}, {1, 0}, {0, 1}};

bool alike(const PreviewPixel& a, const PreviewPixel& b) {
  return a.surface == b.surface &&
         int(a.normal[0]) * b.normal[0] + int(a.normal[1]) * b.normal[1] + int(a.normal[2]) * b.normal[2] > kSameFacing;
}
bool same_light(const PreviewPixel& a, const PreviewPixel& b) {
  return std::equal(a.light, a.light + 3, b.light);
}

// Lattice lines through [first, last], and the next ones beyond as far as `least` and `most`, which are lines where no
// other is beyond.
std::vector<int> lines(int first, int last, int offset, int least, int most) {
  std::vector<int> at;
  int line = first - ((first - offset) % kCell + kCell) % kCell;
  at.push_back(std::max(line, least));
  while (at.back() < last) {
    line += kCell;
    at.push_back(std::min(line, most));
  }
  return at;
}

}  // namespace

// From one lattice point to the next: corners included.
struct SparseSurfaces::Cell {
  int x0, y0, x1, y1;
};

// What is known of a window and of the lattice points around it.
struct SparseSurfaces::Window {
  PixelRect pixels, padded;
  std::vector<PreviewPixel> surfaces;
  std::vector<std::uint32_t> colors;
  enum class Known : std::uint8_t { nothing, wanted, traced, filled };
  std::vector<Known> known;
  std::vector<PixelPosition> wanted;
  std::vector<Cell> cells;
  std::uint64_t rays = 0;

  std::size_t index(int x, int y) const {
    return std::size_t(y - padded.y0) * std::size_t(padded.width()) + std::size_t(x - padded.x0);
  }
  void want(int x, int y) {
    Known& state = known[index(x, y)];
    if (state == Known::traced || state == Known::wanted) return;
    state = Known::wanted;
    wanted.push_back({x, y});
  }
};

SparseSurfaces::SparseSurfaces(const SurfacePass& surfaces, const PreviewView& view, const PreviewBuffer* before,
                               PreviewHistory& history)
    : surfaces_(surfaces),
      region_(view.region),
      before_(before),
      history_(history),
      offset_x_(kTurn[history.frame % 4][0] + 2 * kTurn[history.frame / 4 % 4][0]),
      offset_y_(kTurn[history.frame % 4][1] + 2 * kTurn[history.frame / 4 % 4][1]),
      here_(view.camera, history.width(), history.height(), view.scene->origin()),
      corner_(here_.offset_at(0, 0, 1)),
      step_x_(here_.offset_at(1, 0, 1) - here_.offset_at(0, 0, 1)),
      step_y_(here_.offset_at(0, 1, 1) - here_.offset_at(0, 0, 1)),
      along_(here_.offset_at(0, 0, 1) - here_.offset_at(0, 0, 0)) {
  if (here_.orthographic()) corner_ = V3f(here_.offset_at(0, 0, 0));
  if (before_) {
    const CameraProjection there(before->camera, history.width(), history.height(), view.scene->origin());
    to_before_.emplace(here_, there);
  }
}

// From the view's origin.
V3f SparseSurfaces::point(int x, int y, float depth) const {
  const V3f across = corner_ + step_x_ * (float(x) + 0.5f) + step_y_ * (float(y) + 0.5f);
  return here_.orthographic() ? across + along_ * depth : across * depth;
}

// Whether its corners lie on one flat piece of a surface, or on nothing at all.
bool SparseSurfaces::flat(const Window& w, const Cell& cell) const {
  const int xs[] = {cell.x0, cell.x1, cell.x0, cell.x1}, ys[] = {cell.y0, cell.y0, cell.y1, cell.y1};
  const PreviewPixel* corners[4];
  for (int k = 0; k < 4; ++k) corners[k] = &w.surfaces[w.index(xs[k], ys[k])];
  const PreviewPixel& first = *corners[0];
  const bool shines = first.samples == kExactSamples;
  for (int k = 1; k < 4; ++k) {
    if ((corners[k]->samples == kExactSamples) != shines || !alike(*corners[k], first)) {
      // What was missed has no normal.
      if (!(shines && !first.hit() && corners[k]->samples == kExactSamples && !corners[k]->hit())) return false;
    }
    if (shines && first.hit() && !same_light(*corners[k], first)) return false;
  }
  if (!first.hit()) return true;
  const V3f normal = first.unpacked_normal(), origin = point(xs[0], ys[0], first.depth);
  const float slack = kOffPlane * float(here_.footprint(first.depth));
  for (int k = 1; k < 4; ++k) {
    const V3f across = point(xs[k], ys[k], corners[k]->depth) - origin;
    if (!(std::fabs(dot(across, normal)) <= slack + kTilt * length(across))) return false;
  }
  return true;
}

// Pixels of a flat cell that have no ray.
void SparseSurfaces::fill(Window& w, const Cell& cell) const {
  const PreviewPixel& a = w.surfaces[w.index(cell.x0, cell.y0)];
  const std::size_t corners[] = {w.index(cell.x0, cell.y0), w.index(cell.x1, cell.y0), w.index(cell.x0, cell.y1),
                                 w.index(cell.x1, cell.y1)};
  Rgb colors[4];
  float depths[4];  // or what is linear in the picture in its place
  for (int k = 0; k < 4; ++k) {
    colors[k] = unpack_color(w.colors[corners[k]]);
    const float depth = w.surfaces[corners[k]].depth;
    depths[k] = here_.orthographic() ? depth : 1 / depth;
  }
  const bool one_color = w.colors[corners[0]] == w.colors[corners[1]] && w.colors[corners[0]] == w.colors[corners[2]] &&
                         w.colors[corners[0]] == w.colors[corners[3]];
  const float step_x = 1 / float(std::max(cell.x1 - cell.x0, 1)), step_y = 1 / float(std::max(cell.y1 - cell.y0, 1));
  for (int y = std::max(cell.y0, w.pixels.y0); y <= std::min(cell.y1, w.pixels.y1 - 1); ++y) {
    for (int x = std::max(cell.x0, w.pixels.x0); x <= std::min(cell.x1, w.pixels.x1 - 1); ++x) {
      const std::size_t i = w.index(x, y);
      if (w.known[i] == Window::Known::traced || w.known[i] == Window::Known::wanted) continue;
      w.known[i] = Window::Known::filled;
      if (!a.hit()) {
        surfaces_.note_miss({x, y}, w.surfaces[i], w.colors[i]);
        continue;
      }
      const float u = float(x - cell.x0) * step_x, v = float(y - cell.y0) * step_y;
      const float shares[] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
      float depth = 0;
      Rgb color(0, 0, 0);
      V3f normal(0, 0, 0);
      for (int k = 0; k < 4; ++k) {
        depth += depths[k] * shares[k];
        color += colors[k] * shares[k];
        normal += w.surfaces[corners[k]].unpacked_normal() * shares[k];
      }
      PreviewPixel& pixel = w.surfaces[i];
      pixel = a;
      pixel.depth = here_.orthographic() ? depth : 1 / depth;
      if (!(pixel.samples == kExactSamples)) pixel.set_normal(normalize(normal));
      w.colors[i] = one_color ? w.colors[corners[0]] : pack_color(color);
    }
  }
}

// Colours of filled pixels from the preview before. What it shows nearer than the cell does is wanted.
void SparseSurfaces::take_colors(Window& w) const {
  if (!before_) return;
  constexpr int kRow = 128;
  float depth[kRow], to_x[kRow], to_y[kRow], to_depth[kRow];
  const PixelRect& there = before_->region;
  for (int y = w.pixels.y0; y < w.pixels.y1; ++y) {
    for (int begin = w.pixels.x0; begin < w.pixels.x1; begin += kRow) {
      const int count = std::min(kRow, w.pixels.x1 - begin);
      for (int i = 0; i < count; ++i) {
        const std::size_t k = w.index(begin + i, y);
        depth[i] = w.known[k] == Window::Known::filled ? std::min(w.surfaces[k].depth, kFar) : 1.0f;
      }
      to_before_->map_row(float(begin) + 0.5f, float(y) + 0.5f, count, depth, to_x, to_y, to_depth);
      for (int i = 0; i < count; ++i) {
        const int x = begin + i;
        const std::size_t k = w.index(x, y);
        if (w.known[k] != Window::Known::filled || !(to_depth[i] > 0)) continue;
        if (!(to_x[i] > float(there.x0) && to_x[i] < float(there.x1) && to_y[i] > float(there.y0) &&
              to_y[i] < float(there.y1)))
          continue;
        const PreviewPixel& pixel = w.surfaces[k];
        const std::size_t centre = history_.index(int(to_x[i]), int(to_y[i]));
        const PreviewPixel& tap = before_->pixels[centre];
        if (tap.surface != pixel.surface) {
          if (tap.hit() && tap.depth < to_depth[i] * (1 - kDepthSlack)) w.want(x, y);
          continue;
        }
        if (pixel.samples == kExactSamples) continue;
        const float fx = to_x[i] - 0.5f, fy = to_y[i] - 0.5f;
        const int x0 = int(std::floor(fx)), y0 = int(std::floor(fy));
        const float ax = fx - float(x0), ay = fy - float(y0);
        const float slack = to_depth[i] * kDepthSlack + 2 * float(here_.footprint(to_depth[i]));
        Rgb color(0, 0, 0);
        float weights = 0;
        for (int tap_y = y0; tap_y <= y0 + 1; ++tap_y) {
          for (int tap_x = x0; tap_x <= x0 + 1; ++tap_x) {
            if (!there.contains(tap_x, tap_y)) continue;
            const std::size_t t = history_.index(tap_x, tap_y);
            if (!same_surface(before_->pixels[t], pixel, to_depth[i], slack)) continue;
            const float weight = (tap_x == x0 ? 1 - ax : ax) * (tap_y == y0 ? 1 - ay : ay);
            color += unpack_color(history_.colors_before[t]) * weight;
            weights += weight;
          }
        }
        if (weights > 0.25f) w.colors[k] = pack_color(color * (1 / weights));
      }
    }
  }
}

void SparseSurfaces::trace(Window& w) const {
  // Neighbours share packets.
  std::sort(w.wanted.begin(), w.wanted.end(), [](const PixelPosition& a, const PixelPosition& b) {
    const int row_a = a.y / kCell, row_b = b.y / kCell;
    return row_a != row_b ? row_a < row_b : a.x != b.x ? a.x < b.x : a.y < b.y;
  });
  for (std::size_t first = 0; first < w.wanted.size(); first += SurfacePass::kMostAtOnce) {
    const auto some = std::span<const PixelPosition>(w.wanted)
                          .subspan(first, std::min(SurfacePass::kMostAtOnce, w.wanted.size() - first));
    PreviewPixel pixels[SurfacePass::kMostAtOnce];
    std::uint32_t colors[SurfacePass::kMostAtOnce];
    surfaces_.trace(some, pixels, colors);
    for (std::size_t i = 0; i < some.size(); ++i) {
      const std::size_t k = w.index(some[i].x, some[i].y);
      w.surfaces[k] = pixels[i];
      w.colors[k] = colors[i];
      w.known[k] = Window::Known::traced;
    }
  }
  w.rays += w.wanted.size();
  w.wanted.clear();
}

std::uint64_t SparseSurfaces::run(const PixelRect& window) const {
  thread_local Window w;
  w.pixels = window;
  w.padded = intersect({window.x0 - kCell, window.y0 - kCell, window.x1 + kCell, window.y1 + kCell}, region_);
  const auto size = std::size_t(w.padded.area());
  w.surfaces.resize(size);
  w.colors.resize(size);
  w.known.assign(size, Window::Known::nothing);
  w.wanted.clear();
  w.cells.clear();
  w.rays = 0;

  const auto columns = lines(window.x0, window.x1 - 1, offset_x_, region_.x0, region_.x1 - 1);
  const auto rows = lines(window.y0, window.y1 - 1, offset_y_, region_.y0, region_.y1 - 1);
  for (std::size_t j = 0; j < rows.size(); ++j) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      w.want(columns[i], rows[j]);
      // A region of one row or column has cells without a side.
      const std::size_t right = std::min(i + 1, columns.size() - 1), below = std::min(j + 1, rows.size() - 1);
      if ((right > i || columns.size() == 1) && (below > j || rows.size() == 1))
        w.cells.push_back({columns[i], rows[j], columns[right], rows[below]});
    }
  }
  trace(w);
  std::vector<Cell> flat_cells, halved;
  while (!w.cells.empty()) {
    halved.clear();
    for (const Cell& cell : w.cells) {
      const int width = cell.x1 - cell.x0, height = cell.y1 - cell.y0;
      if (width <= 1 && height <= 1) continue;
      if (cell.x1 < window.x0 || cell.y1 < window.y0 || cell.x0 >= window.x1 || cell.y0 >= window.y1) continue;
      if (std::max(width, height) <= kAllowed && flat(w, cell)) {
        flat_cells.push_back(cell);
        continue;
      }
      const int xm = cell.x0 + width / 2, ym = cell.y0 + height / 2;
      const int xs[] = {cell.x0, xm, cell.x1}, ys[] = {cell.y0, ym, cell.y1};
      for (const int y : ys) {
        for (const int x : xs) w.want(x, y);
      }
      for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) halved.push_back({xs[i], ys[j], xs[i + 1], ys[j + 1]});
      }
    }
    trace(w);
    w.cells.swap(halved);
  }
  for (const Cell& cell : flat_cells) fill(w, cell);
  take_colors(w);
  trace(w);

  for (int y = window.y0; y < window.y1; ++y) {
    const auto from = std::ptrdiff_t(w.index(window.x0, y)), to = std::ptrdiff_t(history_.index(window.x0, y));
    std::copy_n(w.surfaces.begin() + from, window.width(), history_.current.pixels.begin() + to);
    std::copy_n(w.colors.begin() + from, window.width(), history_.colors.begin() + to);
  }
  return w.rays;
}

}  // namespace helio
