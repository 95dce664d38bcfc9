#include "coordinator/etcd.h"

#include <utility>

namespace tessera {

etcdserverpb::Compare created_at(const std::string& key, std::int64_t revision) {
  etcdserverpb::Compare compare;
  compare.set_key(key);
  compare.set_target(etcdserverpb::Compare::CREATE);
  compare.set_create_revision(revision);
  return compare;
}

etcdserverpb::Compare changed_at(const std::string& key, std::int64_t revision) {
  etcdserverpb::Compare compare;
  compare.set_key(key);
  compare.set_target(etcdserverpb::Compare::MOD);
  compare.set_mod_revision(revision);
  return compare;
}

etcdserverpb::RequestOp put(const std::string& key, std::string value, std::int64_t lease) {
  etcdserverpb::RequestOp op;
  op.mutable_request_put()->set_key(key);
  op.mutable_request_put()->set_value(std::move(value));
  op.mutable_request_put()->set_lease(lease);
  return op;
}

etcdserverpb::RequestOp erase(const std::string& key, const std::string& end) {
  etcdserverpb::RequestOp op;
  op.mutable_request_delete_range()->set_key(key);
  op.mutable_request_delete_range()->set_range_end(end);
  return op;
}

etcdserverpb::RequestOp read(const std::string& key, const std::string& end, std::int64_t keys_max) {
  etcdserverpb::RequestOp op;
  op.mutable_request_range()->set_key(key);
  op.mutable_request_range()->set_range_end(end);
  op.mutable_request_range()->set_limit(keys_max);
  return op;
}

std::string end_of(std::string prefix) {
  ++prefix.back();
  return prefix;
}

const etcdserverpb::KeyValue* only_key(const etcdserverpb::ResponseOp& response) {
  const auto& found = response.response_range().kvs();
  return found.empty() ? nullptr : &found[0];
}

}  // namespace tessera
