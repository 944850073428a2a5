/** The top view of a scene, to move about in and to draw on. */

import type { JSX } from 'preact';
import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks';
import { MapWindow, type Area, type Pixel, type Spot } from './view.js';

/** What to do with a pointer; a handler that returns false leaves it to moving the map. */
export interface Pen {
  down(spot: Spot, reach: number): boolean;
  move(spot: Spot): void;
  up(spot: Spot): void;
}

export interface MapProps {
  readonly label: string;
  readonly picture: string | undefined;
  readonly area: Area;
  /** What to show at first. */
  readonly focus: Area;
  readonly draw: (context: CanvasRenderingContext2D, window: MapWindow) => void;
  readonly pen?: Pen;
}

/** A finger needs more room than a mouse. */
const REACH = 22;
const CLOSEST = 200;

export function SceneMap({ label, picture, area, focus, draw, pen }: MapProps): JSX.Element {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [image, setImage] = useState<HTMLImageElement | undefined>(undefined);
  const [view, setView] = useState<MapWindow | undefined>(undefined);
  const pointers = useRef(new Map<number, Pixel>());
  const drawing = useRef<number | undefined>(undefined);

  useEffect(() => {
    if (picture === undefined) return;
    const loaded = new Image();
    loaded.onload = () => setImage(loaded);
    loaded.src = picture;
    return () => {
      loaded.onload = null;
    };
  }, [picture]);

  useLayoutEffect(() => {
    const element = canvas.current;
    if (element === null) return;
    const observer = new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = element;
      if (width === 0 || height === 0) return;
      setView((before) => before?.resized(width, height) ?? MapWindow.fit(width, height, focus));
    });
    observer.observe(element);
    return () => observer.disconnect();
    // what is shown at first is decided once
  }, []);

  useEffect(() => {
    const element = canvas.current;
    const context = element?.getContext('2d');
    if (element === null || context === null || context === undefined || view === undefined) return;
    const ratio = window.devicePixelRatio;
    element.width = Math.round(view.width * ratio);
    element.height = Math.round(view.height * ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, view.width, view.height);
    if (image !== undefined) {
      const low = view.pixel({ x: area.min[0], z: area.min[1] });
      const high = view.pixel({ x: area.max[0], z: area.max[1] });
      context.drawImage(image, low.left, low.top, high.left - low.left, high.top - low.top);
    }
    draw(context, view);
  });

  const at = (event: PointerEvent | WheelEvent): Pixel => {
    const box = canvas.current?.getBoundingClientRect();
    return { left: event.clientX - (box?.left ?? 0), top: event.clientY - (box?.top ?? 0) };
  };
  const limits = (shown: MapWindow): [number, number] => {
    const whole = MapWindow.fit(shown.width, shown.height, area);
    return [whole.scale / 2, Math.max(CLOSEST, whole.scale * 4)];
  };
  const zoom = (pixel: Pixel, factor: number): void =>
    setView((shown) => shown?.zoomed(pixel, factor, ...limits(shown)));

  const down = (event: PointerEvent): void => {
    if (view === undefined) return;
    canvas.current?.setPointerCapture(event.pointerId);
    const pixel = at(event);
    pointers.current.set(event.pointerId, pixel);
    const alone = pointers.current.size === 1 && event.button === 0;
    if (alone && pen?.down(view.spot(pixel), REACH / view.scale) === true) {
      drawing.current = event.pointerId;
    }
  };
  const move = (event: PointerEvent): void => {
    const before = pointers.current.get(event.pointerId);
    if (before === undefined || view === undefined) return;
    const now = at(event);
    pointers.current.set(event.pointerId, now);
    if (drawing.current === event.pointerId) {
      pen?.move(view.spot(now));
      return;
    }
    const other = [...pointers.current].find(([id]) => id !== event.pointerId)?.[1];
    if (other === undefined) {
      setView(view.moved(before, now));
      return;
    }
    const apart = (a: Pixel, b: Pixel): number => Math.hypot(a.left - b.left, a.top - b.top);
    zoom(other, apart(now, other) / Math.max(1, apart(before, other)));
  };
  const up = (event: PointerEvent): void => {
    pointers.current.delete(event.pointerId);
    if (drawing.current !== event.pointerId) return;
    drawing.current = undefined;
    if (view !== undefined) pen?.up(view.spot(at(event)));
  };
  const wheel = (event: WheelEvent): void => {
    event.preventDefault();
    zoom(at(event), Math.exp(-event.deltaY * 0.0015));
  };
  const middle = (): Pixel => ({ left: (view?.width ?? 0) / 2, top: (view?.height ?? 0) / 2 });

  return (
    <div class="map">
      <canvas
        ref={canvas}
        role="img"
        aria-label={label}
        onPointerDown={down}
        onPointerMove={move}
        onPointerUp={up}
        onPointerCancel={up}
        onWheel={wheel}
      />
      <div class="zoom">
        <button aria-label="Closer" onClick={() => zoom(middle(), 1.5)}>
          +
        </button>
        <button aria-label="Farther" onClick={() => zoom(middle(), 1 / 1.5)}>
          −
        </button>
        <button
          aria-label="Show all"
          onClick={() =>
            setView((shown) => shown && MapWindow.fit(shown.width, shown.height, area))
          }
        >
          ⤢
        </button>
      </div>
    </div>
  );
}
