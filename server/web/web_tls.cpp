#include "server/web/web_tls.h"

#include <openssl/ssl.h>
#include <spdlog/spdlog.h>

#include <boost/asio/buffer.hpp>

namespace helio {
namespace {

namespace ssl = boost::asio::ssl;

std::shared_ptr<ssl::context> make_context(const TlsMaterial& material, boost::system::error_code& error) {
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  // TLS 1.2 and 1.3 (RFC 8996 for those before).
  context->set_options(ssl::context::default_workarounds | ssl::context::no_sslv2 | ssl::context::no_sslv3 |
                           ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1 | ssl::context::no_compression,
                       error);
  if (!error) context->use_certificate_chain(boost::asio::buffer(material.certificate), error);
  if (!error) context->use_private_key(boost::asio::buffer(material.key), ssl::context::pem, error);
  if (error || material.client_ca.empty()) return context;
  context->add_certificate_authority(boost::asio::buffer(material.client_ca), error);
  if (!error) context->set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert, error);
  // Without it OpenSSL refuses to take a session up again that began with a certificate.
  static constexpr unsigned char kName[] = "heliographd";
  SSL_CTX_set_session_id_context(context->native_handle(), kName, sizeof kName - 1);
  return context;
}

}  // namespace

std::shared_ptr<ssl::context> WebTls::context() {
  if (!certificates_) return nullptr;
  const std::shared_ptr<const TlsMaterial> material = certificates_->current();
  if (material->version == version_) return context_;
  version_ = material->version;
  boost::system::error_code error;
  auto context = make_context(*material, error);
  if (error) {
    // Those before go on; the files were checked, so it is memory that is missing, or the like.
    spdlog::error("http: the files of TLS cannot be used: {}", error.message());
    if (context_) return context_;
  }
  return context_ = std::move(context);
}

}  // namespace helio
