// What leaves on a stream, as bytes. A tile's EXR is handed to gRPC as it is, without another copy.
#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/support/byte_buffer.h>

#include <string>

#include "server/outbound_queue.h"

namespace helio {

// A StreamResponse, for StreamFrames and WatchFrames.
grpc::ByteBuffer to_stream_response(Outbound message, const std::string& session_id);
// A RunJobResponse. Notices and frame begins have no place there and give an empty buffer: send nothing.
grpc::ByteBuffer to_job_response(Outbound message, const std::string& job_id);

grpc::ByteBuffer to_bytes(const google::protobuf::MessageLite& message);

}  // namespace helio
