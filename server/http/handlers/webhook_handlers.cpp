/// Webhooks: deliveries of a job, redelivery, and test calls.

#include "server/http/handlers/handlers.h"
#include "server/resources/resource_json.h"

namespace http::handlers {
namespace {

const Problem webhooks_disabled{failures::webhooks_disabled, "it was started without the option webhook_secret_file"};

Reply deliveries_reply(int status, const std::string& id, const ApiContext& context) {
  return json_reply(status, resources::write(context.deliveries.of_job(id)));
}

Answer get_deliveries(Request&, const queue::JobView& view, const ApiContext& context) {
  return deliveries_reply(200, view.job.id, context);
}

Answer redeliver(Request& request, const queue::JobView& view, const ApiContext& context) {
  if (!context.redeliver) return webhooks_disabled;
  const std::string& delivery = request.parameters.back();
  if (!context.redeliver(view.job.id, delivery)) {
    return Problem{failures::delivery_not_found, "job " + view.job.id + " has no delivery with this id"};
  }
  return deliveries_reply(202, view.job.id, context);
}

Answer test_webhook(Request& request, const ApiContext& context) {
  if (!context.send_test_webhook) return webhooks_disabled;
  const auto webhook = take_request(request, "a webhook", api::read_root<api::Webhook>, context.limits);
  if (!webhook) return webhook.error();
  const std::string id = context.send_test_webhook(webhook->url);
  Reply reply = deliveries_reply(202, id, context);
  reply.headers.emplace_back("Location", "/v1/webhooks/test/" + id);
  return reply;
}

Answer get_webhook_test(Request& request, const ApiContext& context) {
  const std::string& id = request.parameters.front();
  if (!is_id(id) || context.deliveries.of_job(id).empty()) {
    return Problem{failures::delivery_not_found, "there is no test call with this id"};
  }
  return deliveries_reply(200, id, context);
}

}  // namespace

Endpoints webhook_endpoints() {
  return {{"GET", "/v1/jobs/{id}/deliveries", get_deliveries},
          {"POST", "/v1/jobs/{id}/deliveries/{delivery}/redeliver", redeliver},
          {"POST", "/v1/webhooks/test", test_webhook},
          {"GET", "/v1/webhooks/test/{id}", get_webhook_test}};
}

}  // namespace http::handlers
