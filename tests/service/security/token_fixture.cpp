#include "security/token_fixture.h"

#include <grpcpp/generic/generic_stub.h>

namespace helio::test {

const std::string& TokenTest::add_token(const std::string& name, Role role, const TokenQuotas& quotas) {
  const std::string token = AccessTokens::make_random().value();
  lines_.push_back(to_token_line({name, role, quotas, AccessTokens::digest_of(token)}));
  return tokens_[name] = token;
}

void TokenTest::write_tokens() const {
  std::string text = "# of a test\n";
  for (const std::string& line : lines_) text += line + "\n";
  write_file(in("tokens"), text);
}

void TokenTest::start_with_tokens(const std::function<void(ServerConfig&)>& change) {
  write_tokens();
  start([&](ServerConfig& config) {
    config.token_file = in("tokens");
    if (change) change(config);
  });
}

void TokenTest::name_token(grpc::ClientContext& context, const std::string& name) const {
  if (!name.empty()) context.AddMetadata("authorization", "Bearer " + tokens_.at(name));
}

std::string TokenTest::load_as(const std::string& name, double radiance) {
  Upload upload;
  upload.bytes = quad_gltf(radiance);
  grpc::ClientContext context;
  name_token(context, name);
  pb::LoadSceneResponse response;
  auto writer = stub_->LoadScene(&context, &response);
  for (const auto& message : upload.messages()) writer->Write(message);
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.scene().scene_id();
}

grpc::Status TokenTest::create_as(const std::string& name, const std::string& scene_id, int side, std::string* id,
                                  std::uint32_t samples) {
  pb::CreateSessionRequest request;
  request.set_scene_id(scene_id);
  request.mutable_settings()->set_width(side);
  request.mutable_settings()->set_height(side);
  request.mutable_budget()->set_samples(samples);
  pb::CreateSessionResponse response;
  const grpc::Status status = call_as(name, &pb::RenderService::Stub::CreateSession, request, &response);
  if (id) *id = response.session_id();
  return status;
}

TokenStream::TokenStream(pb::RenderService::Stub& stub, const std::string& token, const std::string& session_id) {
  context_.AddMetadata("authorization", "Bearer " + token);
  stream_ = stub.StreamFrames(&context_);
  pb::StreamRequest open;
  open.mutable_open()->set_session_id(session_id);
  stream_->Write(open);
  reader_.start([this](pb::StreamResponse* response) { return stream_->Read(response); });
}

TokenStream::~TokenStream() {
  if (finished_) return;
  context_.TryCancel();
  status();
}

void TokenStream::send(const pb::View& view) {
  pb::StreamRequest request;
  *request.mutable_view() = view;
  stream_->Write(request);
}

grpc::Status TokenStream::status() {
  if (finished_) return status_;
  reader_.wait_for_end();
  finished_ = true;
  return status_ = stream_->Finish();
}

grpc::Status touch(const std::shared_ptr<grpc::Channel>& channel, const std::string& method, const std::string& message,
                   const std::string& token) {
  grpc::ClientContext context;
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  grpc::CompletionQueue queue;
  grpc::GenericStub stub(channel);
  const auto call = stub.PrepareCall(&context, kRenderService + method, &queue);
  const auto wait = [&] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(&queue);
  wait();
  const grpc::Slice slice(message);
  call->Write(grpc::ByteBuffer(&slice, 1), &queue);
  wait();
  call->WritesDone(&queue);
  wait();
  grpc::ByteBuffer answer;
  call->Read(&answer, &queue);
  const bool answered = wait();
  if (answered) context.TryCancel();
  grpc::Status status;
  call->Finish(&status, &queue);
  wait();
  return answered ? grpc::Status::OK : status;
}

}  // namespace helio::test
