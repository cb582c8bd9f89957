// How an inspected pixel values a sample: by the target function that techniques of direct light share.
#include "techniques/common/observed.wgsl"

fn observed_value(sample: LightSample) -> ValuedSample {
    return value_sample(observed_surface, sample, false);
}
