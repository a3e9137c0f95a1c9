#include "client/tls/credentials.h"

#include "renderer/codec/pem_files.h"

namespace helio {
namespace {

grpc::SslCredentialsOptions read_files(const TlsOptions& options, Problems& problems) {
  grpc::SslCredentialsOptions files;
  if (!options.ca_file.empty()) files.pem_root_certs = read_certificate_file(options.ca_file, "ca_file", problems);
  if (options.certificate_file.empty() && options.key_file.empty()) return files;
  if (options.certificate_file.empty()) problems.add("certificate_file", "is missing: the certificate of the key");
  if (options.key_file.empty()) problems.add("key_file", "is missing: the key of the certificate");
  if (options.certificate_file.empty() || options.key_file.empty()) return files;
  files.pem_cert_chain = read_certificate_file(options.certificate_file, "certificate_file", problems);
  files.pem_private_key =
      read_key_file(options.key_file, files.pem_cert_chain, options.certificate_file, "key_file", problems);
  return files;
}

}  // namespace

Problems find_tls_problems(const TlsOptions& options) {
  Problems problems;
  if (options.on) read_files(options, problems);
  return problems;
}

Result<std::shared_ptr<grpc::ChannelCredentials>> make_channel_credentials(const TlsOptions& options) {
  if (!options.on) return grpc::InsecureChannelCredentials();
  Problems problems;
  const grpc::SslCredentialsOptions files = read_files(options, problems);
  if (problems.empty()) return grpc::SslCredentials(files);
  Problems named;
  for (const Problems::Item& item : problems.items()) named.add("tls." + item.where, item.message);
  return named.to_error();
}

}  // namespace helio
