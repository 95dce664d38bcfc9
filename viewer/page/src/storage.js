// What the browser remembers of the web UI; nothing where it is told to remember nothing.
export const storage = {
  getItem(key) {
    try {
      return localStorage.getItem(key);
    } catch {
      return null;
    }
  },
  setItem(key, value) {
    try {
      localStorage.setItem(key, value);
    } catch {
      // Lasts until the page is closed.
    }
  },
};
