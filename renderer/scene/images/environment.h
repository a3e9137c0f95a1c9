// Light from infinity: the map's geometry, its radiance in a direction, and the density that importance-samples it.
//
// Latitude-longitude convention (that of Mitsuba's envmap, y up; d is the direction from the scene towards the light,
// in map space, unit):
//
//   u = atan2(d.x, -d.z) / (2 pi) mod 1        v = acos(d.y) / pi
//   d = (sin(2 pi u) sin(pi v), cos(pi v), -cos(2 pi u) sin(pi v))
//
// so the top row is +y, the left and right edges look along -z, the first quarter along +x, the centre column along
// +z, the third quarter along -x. Texel centres lie at (i + 0.5) / width and (j + 0.5) / height; radiance is bilinear
// between them, wrapped in u and clamped in v. (Mitsuba's first and last rows lie on the poles, row = v (height - 1):
// up to half a texel off in v, and 1 / height more light from every row.) Environment::to_world takes map directions to
// the world; only its rotation counts.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/result.h"
#include "renderer/scene/description/scene_description.h"
#include "renderer/scene/images/image_decoder.h"
#include "renderer/scene/images/texture.h"

namespace helio {

class FileSource;

// (u, v) of a unit direction in map space, both in [0, 1), and back.
V2f environment_uv(const V3f& direction);
V3f environment_direction(const V2f& uv);

// Reads "R,G,B" (three finite numbers >= 0: constant radiance, W / (sr m^2)) or the name of an image file, which is
// read through `source`, decoded within `max_bytes` and appended to `images`; `notices` and `reserve` as in
// decode_image(). Integer images are taken as sRGB-encoded, float images as linear radiance; negative texels count as 0.
// Errors: invalid_argument (`where` "environment" or the file; also for NaN or infinite texels, named by place),
// not_found, permission_denied, resource_exhausted; failed_precondition when a file is named and source is null.
Result<Environment> parse_environment(const std::string& text, const FileSource* source, std::uint64_t max_bytes,
                                      std::vector<Image>& images, std::vector<std::string>* notices = nullptr,
                                      const ReserveBytes& reserve = {});

// invalid_argument: a texel is infinite or NaN; the message has its place and a remedy.
Status check_environment_image(const Image& image);
// Checks a decoded image so, for use as an environment map, and sets negative texels to 0.
Status prepare_environment_image(Image& image);

// Radiance arriving from a direction. Immutable, safe to share between threads.
class EnvironmentMap {
 public:
  // `textures` must outlive the map when the environment has an image.
  EnvironmentMap(const Environment& environment, const TextureTable* textures);

  // World-space unit direction, from the scene outwards. W / (sr m^2), finite, >= 0.
  Rgb radiance(const V3f& direction) const;
  bool constant() const { return textures_ == nullptr; }

  V3f to_map(const V3f& world) const;
  V3f to_world(const V3f& map) const;
  const TextureTable* textures() const { return textures_; }
  const TextureSlot& slot() const { return slot_; }
  const Rgb& scale() const { return scale_; }
  std::span<const V3f, 3> axes() const { return axes_; }  // world directions of the map's x, y and z axes

 private:
  Rgb scale_;
  TextureSlot slot_;
  const TextureTable* textures_ = nullptr;
  V3f axes_[3];
};

struct EnvironmentSample {
  V3f direction{0, 1, 0};  // world, unit, towards the light
  float pdf_w = 0;         // solid angle density; 0: no sample (rounding put the direction where no light comes from)
};

// Piecewise-constant density over the sphere, proportional to the mean luminance of the bilinear map over each cell
// times the cell's solid angle. Cells divide the map evenly: two by two per texel for small maps, several texels each
// for maps beyond kMaxCells, so that memory stays below 4 bytes times kMaxCells (plus 1 %). Inside a cell the density
// is uniform in solid angle; every direction with radiance has a density > 0.
class EnvironmentDistribution {
 public:
  static constexpr std::size_t kMaxCells = std::size_t(1) << 23;

  // An all-black map gets the uniform density. Constant environments need no distribution, but may have one.
  explicit EnvironmentDistribution(const EnvironmentMap& map);

  // u in [0, 1)^2. The pdf is that of pdf_w() for the direction returned, bit for bit.
  EnvironmentSample sample(const V2f& u) const;
  float pdf_w(const V3f& direction) const;

  // Integral of the map's luminance over the sphere, W / m^2: times pi r^2 the power that enters a sphere of radius r.
  double total_luminance() const { return total_luminance_; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  std::size_t memory_bytes() const;

  // Cumulative counts out of 2^32 - 1, the end of each cell: per row of cells over its columns, and over the rows. A
  // cell with light owns at least one count.
  std::span<const std::uint32_t> column_cdf() const { return column_cdf_; }
  std::span<const std::uint32_t> row_cdf() const { return row_cdf_; }
  std::span<const double> row_cos() const { return row_cos_; }  // cosine of the polar angle at the rows' edges
  std::span<const float> density() const { return density_; }   // per row: 1 / (solid angle of a cell * (2^32 - 1)^2)

 private:
  EnvironmentMap map_;
  int columns_ = 0, rows_ = 0;
  double total_luminance_ = 0;
  std::vector<std::uint32_t> column_cdf_, row_cdf_;
  std::vector<double> row_cos_;
  std::vector<float> density_;
};

}  // namespace helio
