// The frames of a session or job, shown in tev while their tiles come in.
#pragma once

#include <functional>
#include <string>

#include "client/tev/tev_sender.h"
#include "heliograph/v1/types.pb.h"

namespace helio {

// Thread safe, as TevSender.
class TevBridge {
 public:
  // `format`: of the tiles; it decides which channels the image has (tev_channels). `warn`: see TevSender.
  TevBridge(TevAddress address, const heliograph::v1::TileFormat& format, std::function<void(const std::string&)> warn,
            const TevTiming& timing = {});

  // Names the image of all frames that follow by scene and session: two runs have an image each, which a viewer can
  // compare.
  void set_name(const std::string& scene, const std::string& session_id);
  // A frame of that size; the same size again goes on with the image. Errors: those of TevSender::begin().
  Status begin(const heliograph::v1::RenderSettings& settings);
  // Tiles of the film, of frames of that size; previews and JPEG are left out. Bytes are decoded when they are sent.
  void add(heliograph::v1::Tile tile);

  void finish() { sender_.finish(); }
  TevReport report() const { return sender_.report(); }
  std::string image_name() const;

 private:
  const std::vector<std::string> channels_;
  mutable std::mutex mutex_;
  std::string name_;
  TevSender sender_;
};

}  // namespace helio
