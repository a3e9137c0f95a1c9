// A daemon with a token file of a test's own, and calls that name a token.
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "process.h"
#include "server/base/access_tokens.h"
#include "service_fixture.h"

namespace helio::test {

class TokenTest : public ServiceTest {
 protected:
  std::string in(const std::string& name) const { return folder_ / name; }

  // A token of this name and its line in the daemon's token file, which write_tokens() writes.
  const std::string& add_token(const std::string& name, Role role, const TokenQuotas& quotas = {});
  void write_tokens() const;
  // Starts a daemon with these tokens.
  void start_with_tokens(const std::function<void(ServerConfig&)>& change = {});
  const std::string& token(const std::string& name) const { return tokens_.at(name); }
  // Names the token of this name; empty: none.
  void name_token(grpc::ClientContext& context, const std::string& name) const;

  template <class Request, class Response>
  grpc::Status call_as(const std::string& name,
                       grpc::Status (pb::RenderService::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                       const Request& request, Response* response) const {
    grpc::ClientContext context;
    name_token(context, name);
    return (*stub_.*method)(&context, request, response);
  }
  std::string load_as(const std::string& name, double radiance = 1);
  grpc::Status create_as(const std::string& name, const std::string& scene_id, int side, std::string* id = nullptr,
                         std::uint32_t samples = 1);

  TemporaryFolder folder_;

 private:
  std::map<std::string, std::string> tokens_;
  std::vector<std::string> lines_;
};

// StreamFrames of one session by a token; reads until it ends.
class TokenStream {
 public:
  TokenStream(pb::RenderService::Stub& stub, const std::string& token, const std::string& session_id);
  ~TokenStream();
  bool opened() {  // waits for it
    return reader_.wait_for([](const auto& m) { return m.has_opened(); });
  }
  void send(const pb::View& view);
  grpc::Status status();  // after its end
  void cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<pb::StreamRequest, pb::StreamResponse>> stream_;
  StreamReader reader_;
  bool finished_ = false;
  grpc::Status status_;
};

// Sends one message as it is to a method, takes one answer, and gives up: the status of a call that is refused, else
// CANCELLED or what the message led to.
grpc::Status touch(const std::shared_ptr<grpc::Channel>& channel, const std::string& method, const std::string& message,
                   const std::string& token);

}  // namespace helio::test
