// A page whose only moving parts are its viewers.
import { startViewers } from './viewers.js';

void startViewers();
