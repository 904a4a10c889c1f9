/** The metrics that a chart may show. */

import type { MetricName } from "../protocol";

/** The metrics that no other chart shows: each is shown once. */
export function availableMetrics(names: readonly MetricName[], shown: readonly string[], own: string): MetricName[] {
  return names.filter(({ key }) => key === own || !shown.includes(key));
}
