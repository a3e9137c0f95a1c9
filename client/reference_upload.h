// LoadReference as a client stream: begin, then the file in chunks.
#pragma once

#include <grpcpp/support/sync_stream.h>

#include <functional>
#include <string>

#include "heliograph/v1/compare.pb.h"
#include "renderer/base/result.h"

namespace helio {

// Writes the whole file. Stops early, without an error, when the server has ended the call: its status tells why.
// Errors: not_found, invalid_argument (it is empty), internal (it cannot be read, or changed its size meanwhile).
Status write_reference(grpc::ClientWriterInterface<heliograph::v1::LoadReferenceRequest>& call, const std::string& path,
                       const std::function<void(std::uint64_t, std::uint64_t)>& uploaded);

}  // namespace helio
