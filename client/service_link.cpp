#include "client/service_link.h"

namespace helio {

namespace {

// Key of the trailing metadata that names the fields which an older server ignored.
constexpr char kIgnoredFieldsKey[] = "heliograph-ignored-fields";

}  // namespace

void ServiceLink::authorize(grpc::ClientContext& context) const {
  if (!options_.token.empty()) context.AddMetadata("authorization", "Bearer " + options_.token);
}

Status ServiceLink::status_of(const grpc::Status& status, const grpc::ClientContext& context) const {
  if (!status.ok()) return to_error(status, peer_);
  const auto found = context.GetServerTrailingMetadata().find(kIgnoredFieldsKey);
  if (found != context.GetServerTrailingMetadata().end() && options_.notice) {
    options_.notice("the server at " + peer_ + " is older than this client and ignored " +
                    std::string(found->second.data(), found->second.size()));
  }
  return ok_status();
}

}  // namespace helio
