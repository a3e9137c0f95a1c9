#include "server/app/tls_credentials.h"

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>

#include <atomic>
#include <string>
#include <utility>

namespace helio {
namespace {

// grpc::SslServerCredentials takes one certificate for good, and the FileWatcherCertificateProvider of gRPC's
// experimental namespace takes whatever the files hold, also a key that belongs to another certificate: then it serves
// nobody. The callback below is the stable way to hand over a new one.
class TlsCredentials final : public grpc::ServerCredentials {
 public:
  explicit TlsCredentials(std::shared_ptr<TlsCertificates> certificates) : certificates_(std::move(certificates)) {
    const auto ask = certificates_->asks_callers() ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                                   : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE;
    credentials_ = grpc_ssl_server_credentials_create_with_options(
        grpc_ssl_server_credentials_create_options_using_config_fetcher(ask, &fetch, this));
  }
  ~TlsCredentials() override { grpc_server_credentials_release(credentials_); }

  // Tokens are looked at by RenderService, whose calls from the page know no credentials.
  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  // gRPC calls it for every connection.
  static grpc_ssl_certificate_config_reload_status fetch(void* self, grpc_ssl_server_certificate_config** config) {
    auto& credentials = *static_cast<TlsCredentials*>(self);
    const std::shared_ptr<const TlsMaterial> material = credentials.certificates_->current();
    if (credentials.given_.exchange(material->version) == material->version)
      return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair pair{material->key.c_str(), material->certificate.c_str()};
    // gRPC wants some root here even where no caller is asked for a certificate, and looks at it nowhere then.
    const std::string& roots = material->client_ca.empty() ? material->certificate : material->client_ca;
    *config = grpc_ssl_server_certificate_config_create(roots.c_str(), &pair, 1);
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const std::shared_ptr<TlsCertificates> certificates_;
  std::atomic<std::uint64_t> given_{0};  // version
  grpc_server_credentials* credentials_ = nullptr;
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> make_tls_credentials(std::shared_ptr<TlsCertificates> certificates) {
  return std::make_shared<TlsCredentials>(std::move(certificates));
}

}  // namespace helio
