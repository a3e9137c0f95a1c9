// Puts the parts of a picture together.
#pragma once

#include <string>
#include <vector>

#include "client/shards/shard.h"
#include "heliograph/v1/picture_origin.pb.h"
#include "renderer/base/result.h"
#include "renderer/codec/tile_codec.h"

namespace helio {

struct PicturePart {
  std::string file;  // for messages
  DecodedTile picture;
  heliograph::v1::PictureOrigin origin;
};
// not_found, invalid_argument: it is no EXR, or does not say how it was made.
Result<PicturePart> read_part(const std::string& file);

struct MergeOptions {
  bool mix = false;  // also parts of different builds or instruction paths, whose bits may differ from the whole's
};

struct MergedPicture {
  DecodedTile picture;  // with the header, origin included, of a render of the whole
  heliograph::v1::PictureOrigin origin;
  std::vector<std::string> files;  // of the parts, from the top
  std::vector<Shard> shards;       // as files
  int checked_rows = 0;            // that two parts have, and that are equal bit for bit
};
// Parts in any order. Every channel is that of the whole picture, bit for bit.
// invalid_argument names all that does not belong together: files, and what differs; rows that no part or that two
// parts have; pixels of margins that differ, and so were not rendered by the same program.
Result<MergedPicture> merge_parts(std::vector<PicturePart> parts, const MergeOptions& options = {});

}  // namespace helio
