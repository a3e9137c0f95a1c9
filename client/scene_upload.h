// LoadScene as a client stream: begin, then each file in chunks.
#pragma once

#include <grpcpp/support/sync_stream.h>

#include "client/render_client.h"

namespace helio {

// Writes the whole scene. Stops early, without an error, when the server has ended the call: its status tells why.
// Errors: not_found, internal (a file cannot be read, or changed its size meanwhile).
Status write_scene(grpc::ClientWriterInterface<heliograph::v1::LoadSceneRequest>& call, const LocalScene& scene,
                   const SceneLoadRequest& request);

}  // namespace helio
