// A daemon that speaks TLS, in the test's process, and connections to it.
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>

#include "process.h"
#include "security/certificates.h"
#include "service_fixture.h"

namespace helio::test {

class TlsTest : public ServiceTest {
 protected:
  std::string in(const std::string& name) const { return folder_ / name; }

  // Writes NAME.pem and NAME.key into the test's folder, one after the other, in one step each.
  void write_issued(const std::string& name, const Issued& issued) const;
  // Starts a daemon on 127.0.0.1 with daemon.pem and daemon.key, which are written unless they are there.
  void start_tls(const std::function<void(ServerConfig&)>& change = {});
  // A connection of its own. ca: PEM of whom to trust; own: what to show; empty: nothing.
  std::shared_ptr<grpc::Channel> tls_channel(const std::string& ca, const Issued& own = {}) const;
  // Whether a call comes through.
  static bool answers(const std::shared_ptr<grpc::Channel>& channel);

  TemporaryFolder folder_;
  Authority authority_{"authority of the tests"};
};

}  // namespace helio::test
