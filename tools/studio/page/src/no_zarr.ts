// In the place of zarrita in NiiVue: the page gets NIfTI only.
export {};
