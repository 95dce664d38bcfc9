// etcd by its gRPC API.
#pragma once

#include <functional>
#include <memory>

#include "coordinator/etcd.h"
#include "coordinator/etcd_access.h"

namespace tessera {

// Calls go to one of the members, and to the next after an error. `wake` is called on a thread of its own
// after each call. Waits for nothing: where etcd is gone, or is not whom its certificate has to name, calls
// fail.
std::unique_ptr<Etcd> connect_etcd(const EtcdAccess& access, std::function<void()> wake);

}  // namespace tessera
