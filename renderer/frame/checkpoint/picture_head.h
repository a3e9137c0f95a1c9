// What a checkpoint says of a picture beside its pixels: numbers, the progress of every block, light tiles, the state
// of adaptive counts. As bytes: one field after the other, little-endian; see picture_head.cpp for their order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/film/splats/splat_buffer.h"
#include "renderer/frame/frame_scheduler.h"
#include "renderer/frame/render_settings.h"
#include "renderer/frame/tile_grid.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

struct PictureHead {
  std::uint64_t settings = 0, camera = 0;  // digests, below
  std::int32_t width = 0, height = 0;      // of the film
  PixelRect region;                        // that is rendered
  std::uint64_t view_id = 0;
  double seconds = 0;         // of wall time that the picture has taken
  std::uint64_t samples = 0;  // pixel samples in the film
  TraceStats trace;
  // Of FrameState; what is missing follows from the cells.
  ErrorAtCount measured;
  RoundState round;
  std::vector<CellProgress> cells;  // TileGrid::progress()

  // Of the film.
  std::vector<std::uint8_t> light_tiles;  // 1: with light paths; empty: the film has no LightTiles
  bool splats = false, invalid = false;   // FilmCopy
  SplatBuffer::Totals splat_totals;
  // SampleTargets
  bool demand_known = false;
  std::uint32_t uniform = 0;
  float exponent = 1;
  std::vector<std::uint32_t> histogram[kHalves];
};

// Of what decides the samples of a picture | of a fitted() camera.
std::uint64_t settings_digest(const RenderSettings& settings);
std::uint64_t camera_digest(const CameraPose& camera);

// What is the film's in the head, and back. The film is of the picture's settings; its pixels stay as they are.
void read_film(const Film& film, PictureHead& head);
void write_film(const PictureHead& head, Film& film);

std::vector<std::uint8_t> encode(const PictureHead& head);
// Longer is none of these settings.
std::uint64_t most_head_bytes(const RenderSettings& settings);
// From the front of `bytes`, of which as many are dropped as were read. Every field lies in its range, lists have the
// sizes that the settings, which are valid, ask for, and numbers that depend on each other agree.
Result<PictureHead> decode_head(std::span<const std::uint8_t>& bytes, const RenderSettings& settings);

}  // namespace helio
