#include "server/jobs/delivery_store.h"

namespace jobs {

const char* name_of(DeliveryState state) {
  switch (state) {
    case DeliveryState::pending:
      return "pending";
    case DeliveryState::delivered:
      return "delivered";
    case DeliveryState::given_up:
      break;
  }
  return "given_up";
}

}  // namespace jobs
