#include "renderer/frame/checkpoint/picture_head.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "renderer/base/hash.h"
#include "renderer/base/number_range.h"
#include "renderer/film/allocation/neyman_allocation.h"
#include "renderer/film/core/light_tiles.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/frame/stages/allocate.h"

namespace helio {
namespace {

constexpr std::uint64_t kMostCount = std::uint64_t(1) << 31;  // of samples of a pixel

// Numbers one by one; flags as a byte, 0 or 1.
class Writer {
 public:
  explicit Writer(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  template <class T>
  void number(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof value);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
  }
  template <class T, class Each>
  void list(const std::vector<T>& values, std::size_t, const Each& each) {
    number(std::uint64_t(values.size()));
    for (const T& value : values) each(value);
  }

 private:
  std::vector<std::uint8_t>& bytes_;
};

// Stops at what does not fit: everything after it stays as it was.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <class T>
  void number(T& value) {
    static_assert(std::is_arithmetic_v<T>);
    if (!take(sizeof value)) return;
    if constexpr (std::is_same_v<T, bool>) {
      if (bytes_[0] > 1) return fail("a flag is " + std::to_string(bytes_[0]) + "; allowed: 0, 1");
      value = bytes_[0] == 1;
    } else {
      std::memcpy(&value, bytes_.data(), sizeof value);
    }
    bytes_ = bytes_.subspan(sizeof value);
  }
  // Empty, or so many; each takes at least a byte.
  template <class T, class Each>
  void list(std::vector<T>& values, std::size_t count, const Each& each) {
    std::uint64_t size = 0;
    number(size);
    if (!failure_.empty()) return;
    if (size != 0 && size != count)
      return fail("a list has " + std::to_string(size) + " entries; allowed: 0, " + std::to_string(count));
    if (size > bytes_.size())
      return fail("a list has " + std::to_string(size) + " entries, and " + std::to_string(bytes_.size()) +
                  " bytes are left");
    values.resize(std::size_t(size));
    for (T& value : values) each(value);
  }

  const std::string& failure() const { return failure_; }
  std::span<const std::uint8_t> rest() const { return bytes_; }

 private:
  bool take(std::size_t size) {
    if (failure_.empty() && size > bytes_.size()) fail("the bytes end too early");
    return failure_.empty();
  }
  void fail(std::string why) {
    if (failure_.empty()) failure_ = std::move(why);
  }

  std::span<const std::uint8_t> bytes_;
  std::string failure_;
};

// What lists have that are not empty.
struct ListSizes {
  std::size_t cells = 0, light_tiles = 0, histogram = 0;
};

ListSizes list_sizes(const RenderSettings& settings) {
  const PixelRect region = settings.rendered_region();
  const LightTiles tiles(settings.width, settings.height, false);
  return {blocks_of(region), tiles.size(), NeymanAllocation::kHistogramBins};
}

// All fields, in the order in which they are stored: one place for both ways. Io: Writer with a const head, or Reader.
// First what says which picture it is.
template <class Io, class Head>
void for_name(Io& io, Head& head) {
  const auto numbers = [&](auto&... values) { (io.number(values), ...); };
  numbers(head.settings, head.camera, head.width, head.height);
  numbers(head.region.x0, head.region.y0, head.region.x1, head.region.y1);
}

template <class Io, class Head>
void for_fields(Io& io, Head& head, const ListSizes& sizes) {
  const auto numbers = [&](auto&... values) { (io.number(values), ...); };
  numbers(head.view_id, head.seconds, head.samples);
  {
    auto& [paths, light_paths, rays, shadow_rays, invalid_samples, invalid_splats, bright_splats, media_overflows,
           dropped, first] = head.trace;
    numbers(paths, light_paths, rays, shadow_rays, invalid_samples, invalid_splats, bright_splats, media_overflows,
            dropped);
    auto& [x, y, half, index, all_light_paths, light_path] = first;
    numbers(x, y, half, index, all_light_paths, light_path);
  }
  {
    auto& [rmse, relmse, worst_tile_rmse, unproven, hidden_rmse, hidden_relmse, bias, bias_error, known] =
        head.measured.error;
    numbers(head.measured.samples, rmse, relmse, worst_tile_rmse, unproven, hidden_rmse, hidden_relmse, bias,
            bias_error, known);
  }
  numbers(head.round.number, head.round.first_samples, head.round.mean, head.round.measured);
  for (int h = 0; h < kHalves; ++h) {
    numbers(head.round.summary.top[h]);
    for (auto& samples : head.round.summary.by_octave[h]) numbers(samples);
  }
  io.list(head.cells, sizes.cells, [&](auto& cell) {
    numbers(cell.done[0], cell.done[1], cell.top[0], cell.top[1], cell.rendered);
  });
  io.list(head.light_tiles, sizes.light_tiles, [&](auto& on) { numbers(on); });
  numbers(head.splats, head.invalid);
  auto& [light_paths, invalid_outside, any_invalid] = head.splat_totals;
  numbers(light_paths[0], light_paths[1], invalid_outside, any_invalid);
  numbers(head.demand_known, head.uniform, head.exponent);
  for (auto& histogram : head.histogram) io.list(histogram, sizes.histogram, [&](auto& pixels) { numbers(pixels); });
}

Error refused(const std::string& where, const std::string& value, const std::string& allowed,
              ErrorCode code = ErrorCode::invalid_argument) {
  return {code, value + "; allowed: " + allowed, where};
}

std::string text(const PixelRect& r) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "[%d, %d) x [%d, %d)", r.x0, r.x1, r.y0, r.y1);
  return buffer;
}

// Whether the head is that of a picture of these settings.
Status check_settings(const PictureHead& head, const RenderSettings& settings) {
  const auto size = [](int width, int height) { return std::to_string(width) + " x " + std::to_string(height); };
  if (head.width != settings.width || head.height != settings.height)
    return refused("film", size(head.width, head.height), size(settings.width, settings.height),
                   ErrorCode::failed_precondition);
  if (head.region != settings.rendered_region())
    return refused("region", text(head.region), text(settings.rendered_region()), ErrorCode::failed_precondition);
  if (head.settings != settings_digest(settings))
    return refused("settings", "others than those that are asked for", "those that the picture was begun with",
                   ErrorCode::failed_precondition);
  return ok_status();
}

Status check_range(const char* where, double value, double least, double most) {
  if (value >= least && value <= most) return ok_status();
  return refused(where, number_text(value), NumberRange{least, most}.to_string());
}

Status check_cells(const PictureHead& head, std::size_t count) {
  if (head.cells.size() != count)
    return refused("cells", std::to_string(head.cells.size()), std::to_string(count));
  std::uint32_t top[kHalves] = {0, 0};
  for (const CellProgress& cell : head.cells) {
    if (!cell.rendered && head.round.number > 0)
      return refused("cells.rendered", "no in round " + std::to_string(head.round.number), "yes");
    for (int h = 0; h < kHalves; ++h) {
      if (cell.done[h] > kMostCount)
        return refused("cells.done", std::to_string(cell.done[h]), "[0, " + std::to_string(kMostCount) + "]");
      if (!cell.rendered && cell.done[h] > 0)
        return refused("cells.done", std::to_string(cell.done[h]) + " where nothing was rendered", "0");
      const bool none = cell.top[h] == Cell::kNoTop;
      if (none != (head.round.number == 0) || (!none && cell.top[h] > kMostCount))
        return refused("cells.top", std::to_string(cell.top[h]) + " in round " + std::to_string(head.round.number),
                       "none before the first round, then [0, " + std::to_string(kMostCount) + "]");
      if (!none) top[h] = std::max(top[h], cell.top[h]);
    }
  }
  for (int h = 0; h < kHalves; ++h) {
    if (head.round.summary.top[h] != top[h])
      return refused("round.top", std::to_string(head.round.summary.top[h]), std::to_string(top[h]) + ", of the cells");
  }
  return ok_status();
}

Status check_round(const PictureHead& head, const FilmState& film, std::size_t bins) {
  const RoundState& round = head.round;
  if (round.number > 0 && !film.targets)
    return refused("round.number", std::to_string(round.number), "0 where counts do not differ");
  if (auto ok = check_range("round.number", round.number, 0, double(kMostCount)); !ok) return ok;
  if (auto ok = check_range("round.first_samples", round.first_samples, 0, 0); !ok) return ok;
  if (auto ok = check_range("round.mean", round.mean, 0, double(kMostCount)); !ok) return ok;
  if (auto ok = check_range("round.measured", double(round.measured), 0, double(head.samples)); !ok) return ok;
  if (auto ok = check_range("targets.uniform", head.uniform, 0, double(kMostCount)); !ok) return ok;
  if (auto ok = check_range("targets.exponent", head.exponent, 0, 1); !ok) return ok;
  for (const auto& histogram : head.histogram) {
    if (head.demand_known && histogram.size() != bins)
      return refused("targets.histogram", std::to_string(histogram.size()), std::to_string(bins));
  }
  return ok_status();
}

Status check_trace(const InvalidSample& first, const PictureHead& head) {
  if (auto ok = check_range("trace.first_invalid.x", first.x, 0, head.width - 1); !ok) return ok;
  if (auto ok = check_range("trace.first_invalid.y", first.y, 0, head.height - 1); !ok) return ok;
  return check_range("trace.first_invalid.half", first.half, 0, kHalves - 1);
}

Status check_lights(const PictureHead& head, const RenderSettings& settings, const FilmState& film) {
  const auto& tiles = head.light_tiles;
  if (!tiles.empty() && settings.integrator != Integrator::pt_bdpt)
    return refused("light_tiles", std::to_string(tiles.size()), "none but with integrator pt+bdpt");
  for (const std::uint8_t on : tiles) {
    if (on > 1) return refused("light_tiles", std::to_string(on), "0, 1");
  }
  const bool splats = film.splats && (tiles.empty() || std::count(tiles.begin(), tiles.end(), 1) > 0);
  if (head.splats != splats)
    return refused("splats", head.splats ? "present" : "none", splats ? "present" : "none");
  return ok_status();
}

}  // namespace

// One more field does not compile until it is told here. Previews change nothing about films.
std::uint64_t settings_digest(const RenderSettings& settings) {
  std::uint64_t digest = kFnv1aStart;
  const auto add = [&](auto... values) {
    const auto bits = [](auto value) {
      if constexpr (std::is_same_v<decltype(value), double>) return std::bit_cast<std::uint64_t>(value);
      else return std::uint64_t(value);
    };
    ((digest = fnv1a(digest, bits(values))), ...);
  };
  const auto& [width, height, mode, variant, integrator, technique, adaptive, reprojection, light_cache, seed,
               max_segments, roulette_from, roulette, filter, region, device, preview,
               foveation] = settings;
  add(width, height, mode, variant, integrator, technique.has_value());
  const auto& [light_vertices, camera_vertices, unweighted] = technique.value_or(Technique());
  add(light_vertices, camera_vertices, unweighted);
  const auto& [min_samples, max_samples, measure] = adaptive;
  add(min_samples, max_samples, measure);
  const auto& [stored_hits, max_error] = reprojection;
  add(stored_hits, max_error);
  const auto& [connections, radius, shrinking] = light_cache;
  add(connections, radius, shrinking);
  add(seed, max_segments, roulette_from, roulette);
  const auto& [filter_kind, filter_scale] = filter;
  add(filter_kind, filter_scale);
  const PixelRect rendered = settings.rendered_region();
  add(rendered.x0, rendered.y0, rendered.x1, rendered.y1);
  const auto& [device_kind, device_index] = device;
  add(device_kind, device_index);
  const auto& [foveation_kind, viewing_distance, published] = foveation;
  const bool foveated = foveation_kind == Foveation::density;
  add(foveated ? foveation_kind : Foveation::none, foveated ? viewing_distance : 0);
  static_cast<void>(region), static_cast<void>(preview), static_cast<void>(published);
  return hash64(digest);
}

std::uint64_t camera_digest(const CameraPose& camera) {
  std::uint64_t digest = kFnv1aStart;
  const auto add = [&](double value) { digest = fnv1a(digest, std::bit_cast<std::uint64_t>(value + 0.0)); };
  const auto& [projection, position, right, up, forward, vertical_fov, half_height, lens_radius, focus_distance,
               aspect] = camera;
  add(double(projection));
  for (const V3d* v : {&position, &right, &up, &forward}) {
    for (const double x : {v->x, v->y, v->z}) add(x);
  }
  for (const double x : {vertical_fov, half_height, lens_radius, focus_distance, aspect}) add(x);
  return hash64(digest);
}

void read_film(const Film& film, PictureHead& head) {
  head.width = film.width();
  head.height = film.height();
  head.invalid = film.any_invalid();
  head.splats = film.splats() != nullptr;
  if (head.splats) head.splat_totals = film.splats()->totals();
  if (const LightTiles* tiles = film.light_tiles().get()) {
    for (std::size_t t = 0; t < tiles->size(); ++t)
      head.light_tiles.push_back(tiles->on(tiles->window(t).x0, tiles->window(t).y0));
  }
  if (const SampleTargets* targets = film.targets()) {
    head.demand_known = targets->demand_known;
    head.uniform = targets->uniform;
    head.exponent = targets->exponent;
    std::copy(targets->histogram, targets->histogram + kHalves, head.histogram);
  }
}

void write_film(const PictureHead& head, Film& film) {
  std::shared_ptr<LightTiles> tiles;
  if (!head.light_tiles.empty()) {
    tiles = std::make_shared<LightTiles>(head.width, head.height, false);
    for (std::size_t t = 0; t < head.light_tiles.size(); ++t) tiles->set(t, head.light_tiles[t] != 0);
  }
  film.set_light_tiles(std::move(tiles));
  if (head.splats) film.splats()->set_totals(head.splat_totals);
  if (SampleTargets* targets = film.targets()) {
    targets->round = head.round.summary;
    targets->demand_known = head.demand_known;
    targets->uniform = head.uniform;
    targets->exponent = head.exponent;
    std::copy(head.histogram, head.histogram + kHalves, targets->histogram);
  }
}

std::vector<std::uint8_t> encode(const PictureHead& head) {
  std::vector<std::uint8_t> bytes;
  Writer writer(bytes);
  for_name(writer, head);
  for_fields(writer, head, ListSizes());
  return bytes;
}

std::uint64_t most_head_bytes(const RenderSettings& settings) {
  const ListSizes sizes = list_sizes(settings);
  PictureHead empty;
  return encode(empty).size() + sizes.cells * (sizeof(std::uint32_t) * 4 + 1) + sizes.light_tiles +
         kHalves * sizes.histogram * sizeof(std::uint32_t);
}

Result<PictureHead> decode_head(std::span<const std::uint8_t>& bytes, const RenderSettings& settings) {
  const ListSizes sizes = list_sizes(settings);
  const FilmState film = film_state(settings);
  Reader reader(bytes);
  PictureHead head;
  for_name(reader, head);
  if (reader.failure().empty()) {
    if (auto ok = check_settings(head, settings); !ok) return ok.error();
  }
  for_fields(reader, head, sizes);
  if (!reader.failure().empty()) return Error{ErrorCode::invalid_argument, reader.failure(), "head"};
  bytes = reader.rest();

  const double most_samples = double(head.region.area()) * double(kMostCount);
  if (auto ok = check_range("seconds", head.seconds, 0, 1e12); !ok) return ok.error();
  if (auto ok = check_range("samples", double(head.samples), 0, most_samples); !ok) return ok.error();
  if (auto ok = check_trace(head.trace.first_invalid, head); !ok) return ok.error();
  if (auto ok = check_range("measured.samples", head.measured.samples, 0, double(kMostCount)); !ok) return ok.error();
  if (auto ok = check_round(head, film, sizes.histogram); !ok) return ok.error();
  if (auto ok = check_cells(head, sizes.cells); !ok) return ok.error();
  if (auto ok = check_lights(head, settings, film); !ok) return ok.error();
  head.round.samples = head.samples;
  head.round.pixels = std::uint64_t(head.region.area());
  return head;
}

}  // namespace helio
