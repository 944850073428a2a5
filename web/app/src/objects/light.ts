/** The light of scenes that come without a walk: that of shading/. */

import type { Light } from '@farfield/core';
import light from '../../../../shading/farfield_shading/light.json';

export const LIGHT = light as unknown as Light;
