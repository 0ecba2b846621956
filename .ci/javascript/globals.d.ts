/** Names of types that every module of the page may use in its JSDoc comments without an import. */

/** What the API takes and answers, by the name of its schema: `Api['ObservationOut']`. */
type Api = import('./generated/openapi').components['schemas'];

/** The shared state of the page of an inspection. */
type Desk = import('../../static/components/desk/page/desk.js').Desk;

/** The element of a tag; of several tags, what their elements have in common. */
type Tagged<T extends string> = T extends keyof HTMLElementTagNameMap
  ? HTMLElementTagNameMap[T]
  : T extends keyof SVGElementTagNameMap
    ? SVGElementTagNameMap[T]
    : HTMLElement;

/** Filled in by `generate.py`. */
interface PartsOf {}

/** The named elements of the templates of some modules: `Parts<'strip/strip-log'>`. */
type Parts<Modules extends keyof PartsOf> = Joined<PartsOf[Modules]>;
type Joined<U> = (U extends unknown ? (member: U) => void : never) extends (all: infer All) => void ? All : never;

/** The event of a name: the browser's own, else one that the page fires itself. Its target is in the page's own markup. */
type EventOf<Name extends string> = (Name extends keyof HTMLElementEventMap ? HTMLElementEventMap[Name] : CustomEvent) & {
  readonly target: any;
  readonly currentTarget: any;
};

/** The element of a selector: known where that is a tag. */
type Selected<S extends string> = S extends keyof HTMLElementTagNameMap ? HTMLElementTagNameMap[S] : any;

interface ParentNode {
  querySelector<S extends string>(selectors: S): Selected<S> | null;
  querySelectorAll<S extends string>(selectors: S): NodeListOf<Selected<S>>;
}

interface Document {
  /** Nothing but elements of HTML takes the focus of the page. */
  readonly activeElement: HTMLElement | null;
}

interface Element {
  closest<S extends string>(selectors: S): Selected<S> | null;
}

interface HTMLElement {
  /** The named elements of a row, kept by the module that made it. */
  parts: any;
}

/** The page's own objects fire `CustomEvent`s, or an `Event` without anything in it. */
interface EventTarget {
  addEventListener(type: string, listener: (event: CustomEvent) => void, options?: AddEventListenerOptions): void;
}
