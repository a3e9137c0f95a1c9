// What leaves on a stream, as bytes. A tile's EXR is handed to gRPC as it is, without another copy.
#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/support/byte_buffer.h>

#include <string>
#include <vector>

#include "server/stream/outbound_queue.h"

namespace helio {

// A StreamResponse, for StreamFrames and WatchFrames.
grpc::ByteBuffer to_stream_response(Outbound message, const std::string& session_id);
// A RunJobResponse. Notices and frame begins have no place there and give an empty buffer: send nothing. Ends of frames
// are to_job_result's.
grpc::ByteBuffer to_job_response(Outbound message);
// The RunJobResponse for the end of a view: the job's result when it is `over`, else the view's. `invalid_samples`: of
// the job so far.
grpc::ByteBuffer to_job_result(const FrameReport& report, const std::string& job_id, std::uint32_t view, bool over,
                               std::uint64_t invalid_samples);

// Names the fields of requests that were ignored.
Notice ignored_fields_notice(const std::vector<std::string>& fields);

grpc::ByteBuffer to_bytes(const google::protobuf::MessageLite& message);

}  // namespace helio
